"""What you need to write a part of your own: the protocols, and the records and helpers that they use.

docs/extending.md shows a complete example of each kind. `torc.testing` has a conformance suite for each. The names are
imported when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torc.generation.families import SceneFamily as SceneFamily
    from torc.grasping.protocol import GraspPlanner as GraspPlanner
    from torc.motion.protocol import MotionPlanner as MotionPlanner
    from torc.motion.protocol import PickRequest as PickRequest
    from torc.perception.from_masks import FromMasks as FromMasks
    from torc.perception.from_masks import Masks as Masks
    from torc.perception.protocol import Depth as Depth
    from torc.perception.protocol import Perception as Perception
    from torc.perception.segmentation import PerceptionConfig as PerceptionConfig
    from torc.perception.segmentation import segment as segment
    from torc.records import BACKGROUND as BACKGROUND
    from torc.records import MAX_OBJECTS as MAX_OBJECTS
    from torc.records import ROBOT as ROBOT
    from torc.records import TARGET_ID as TARGET_ID
    from torc.records import Capture as Capture
    from torc.records import GraspReport as GraspReport
    from torc.records import GraspSet as GraspSet
    from torc.records import OcclusionVolume as OcclusionVolume
    from torc.records import PickPlan as PickPlan
    from torc.records import PlanFailure as PlanFailure
    from torc.records import PlanStage as PlanStage
    from torc.records import SegmentedObject as SegmentedObject
    from torc.records import SegmentedScene as SegmentedScene
    from torc.records import StereoPair as StereoPair
    from torc.records import Trajectory as Trajectory
    from torc.records import as_capture as as_capture
    from torc.records.evidence import Tokens as Tokens
    from torc.registry.kinds import ArmTraits as ArmTraits
    from torc.registry.kinds import CameraTraits as CameraTraits
    from torc.registry.kinds import DepthTraits as DepthTraits
    from torc.registry.kinds import MotionPlannerTraits as MotionPlannerTraits
    from torc.registry.kinds import PerceptionTraits as PerceptionTraits
    from torc.registry.kinds import TaskPlannerTraits as TaskPlannerTraits
    from torc.robots.description import RobotDescription as RobotDescription
    from torc.robots.gripper import GripperDescription as GripperDescription
    from torc.robots.protocols import Arm as Arm
    from torc.robots.protocols import Camera as Camera
    from torc.robots.protocols import Gripper as Gripper
    from torc.robots.protocols import GripperState as GripperState
    from torc.robots.protocols import Robot as Robot
    from torc.task_planning.protocol import TaskPlanner as TaskPlanner
    from torc.vlm.failures import FailureKind as FailureKind
    from torc.vlm.failures import VlmError as VlmError
    from torc.vlm.failures import kind_of_status as kind_of_status
    from torc.vlm.protocol import Question as Question
    from torc.vlm.protocol import Reply as Reply
    from torc.vlm.protocol import VlmClient as VlmClient
    from torc.vlm.replies import reply_of as reply_of
    from torc.workspace.description import Workspace as Workspace

_HOMES = {
    "Arm": "torc.robots.protocols",
    "ArmTraits": "torc.registry.kinds",
    "BACKGROUND": "torc.records",
    "Camera": "torc.robots.protocols",
    "Capture": "torc.records",
    "CameraTraits": "torc.registry.kinds",
    "Depth": "torc.perception.protocol",
    "DepthTraits": "torc.registry.kinds",
    "FailureKind": "torc.vlm.failures",
    "FromMasks": "torc.perception.from_masks",
    "GraspPlanner": "torc.grasping.protocol",
    "GraspReport": "torc.records",
    "GraspSet": "torc.records",
    "Gripper": "torc.robots.protocols",
    "GripperDescription": "torc.robots.gripper",
    "GripperState": "torc.robots.protocols",
    "MAX_OBJECTS": "torc.records",
    "Masks": "torc.perception.from_masks",
    "MotionPlanner": "torc.motion.protocol",
    "MotionPlannerTraits": "torc.registry.kinds",
    "OcclusionVolume": "torc.records",
    "Perception": "torc.perception.protocol",
    "PerceptionConfig": "torc.perception.segmentation",
    "PerceptionTraits": "torc.registry.kinds",
    "PickPlan": "torc.records",
    "PickRequest": "torc.motion.protocol",
    "PlanFailure": "torc.records",
    "PlanStage": "torc.records",
    "Question": "torc.vlm.protocol",
    "ROBOT": "torc.records",
    "Reply": "torc.vlm.protocol",
    "Robot": "torc.robots.protocols",
    "RobotDescription": "torc.robots.description",
    "SceneFamily": "torc.generation.families",
    "SegmentedObject": "torc.records",
    "SegmentedScene": "torc.records",
    "StereoPair": "torc.records",
    "TARGET_ID": "torc.records",
    "TaskPlanner": "torc.task_planning.protocol",
    "TaskPlannerTraits": "torc.registry.kinds",
    "Tokens": "torc.records.evidence",
    "Trajectory": "torc.records",
    "VlmClient": "torc.vlm.protocol",
    "VlmError": "torc.vlm.failures",
    "Workspace": "torc.workspace.description",
    "as_capture": "torc.records",
    "kind_of_status": "torc.vlm.failures",
    "reply_of": "torc.vlm.replies",
    "segment": "torc.perception.segmentation",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'torc.protocols' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]
