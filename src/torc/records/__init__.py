"""Immutable records that flow through the pipeline: every stage takes records and returns records."""

from torc.records.camera import (
    BACKGROUND,
    MAX_OBJECTS,
    ROBOT,
    TARGET_ID,
    Capture,
    Observation,
    StereoPair,
    as_capture,
)
from torc.records.decisions import Decision, Exchange, Hand, PlanningContext
from torc.records.evidence import BeliefEvidence, Certainty, Corrections, Evidence, ModelEvidence
from torc.records.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind
from torc.records.grasps import GraspReport, GraspSet, GraspStatus
from torc.records.outcomes import FeltOutcome, PickOutcome, PickResult, Touch
from torc.records.plans import PickPlan, PlanFailure, PlanStage, Trajectory
from torc.records.scene import KnownObject, SegmentedObject, SegmentedScene
from torc.records.volume import EMPTY, OcclusionVolume, VoxelGrid

__all__ = [
    "BACKGROUND",
    "EMPTY",
    "MAX_OBJECTS",
    "ROBOT",
    "TARGET_ID",
    "BeliefEvidence",
    "Capture",
    "Certainty",
    "Corrections",
    "Decision",
    "DependencyEdge",
    "DependencyGraph",
    "DependencyNode",
    "EdgeKind",
    "Evidence",
    "Exchange",
    "FeltOutcome",
    "GraspReport",
    "GraspSet",
    "GraspStatus",
    "Hand",
    "KnownObject",
    "ModelEvidence",
    "Observation",
    "OcclusionVolume",
    "PickOutcome",
    "PickPlan",
    "PickResult",
    "PlanFailure",
    "PlanStage",
    "PlanningContext",
    "SegmentedObject",
    "SegmentedScene",
    "StereoPair",
    "Touch",
    "Trajectory",
    "VoxelGrid",
    "as_capture",
]
