"""The task planners of an option that takes several names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torc.benchmark.spec import BenchPlanner
    from torc.cli.vlm_options import VlmOptions


def planners_of(given: Sequence[tuple[str, dict[str, Any]]], vlm: VlmOptions) -> list[BenchPlanner]:
    """Return planners by name and settings, each with the VLM named behind it, or that of --vlm. Raises InputError."""
    from torc.benchmark.spec import find_planner, split_vlm
    from torc.specs.trial import PlannerSpec

    named = [(*split_vlm(text), settings) for text, settings in given]
    # Options of a VLM may be meant only for those named beside planners.
    for_all = vlm.config() if vlm.vlm or all(own is None for _, own, _ in named) else None
    planners = []
    for name, own, settings in named:
        spec = PlannerSpec(name, for_all if own is None else vlm.config(own), settings)
        planners.append(find_planner(spec, vlm.cache(), own_vlm=own is not None))
    return planners
