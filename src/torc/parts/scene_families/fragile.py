"""Towers and leaning things before the target, which fall if what holds them up is taken."""

from dataclasses import replace

import numpy as np

from torc.generation.arrangements import StructuredConfig
from torc.generation.clutter import without
from torc.generation.config import Reason
from torc.generation.families import SceneFamily, before
from torc.generation.inspection import Inspector, SceneView
from torc.problems.problem import Problem
from torc.sim.settling import COARSE, StillnessConfig, watch_stillness
from torc.sim.simulated_world import build_world

FALLS = StillnessConfig(distance_m=0.02, angle_rad=float(np.deg2rad(15)), seconds=1.5)
"""An object that moves further than this once another one is gone was held up by it."""


class Fragile(SceneFamily):
    """At least one object that hides the target or is before it holds up others."""

    category = "structured"

    def arranged(self, usual: StructuredConfig) -> StructuredConfig:
        """Return an arrangement in which objects of any height are stacked, and high ones lean."""
        return replace(usual, leaning=0.5, stacked=0.8, stacked_height_m=np.inf, storeys=3)

    def unfit(self, view: SceneView, target: str, inspector: Inspector) -> Reason | None:
        """Return whether nothing before the target holds up anything."""
        around = before(view, target, inspector)
        holding = any(holds_up(view.problem, name, inspector) for name in around)
        return None if holding else Reason.NOTHING_HELD_UP


def holds_up(problem: Problem, name: str, inspector: Inspector) -> bool:
    """Return whether something falls if an object vanishes."""
    world = build_world(without(problem, (name,)), None, inspector.workspace, COARSE)
    return not watch_stillness(world, FALLS).still


PART = Fragile
