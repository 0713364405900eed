"""What is done where nobody would feel a contact: slower approaches, and grasps further from their neighbours."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from torc.pipeline.building import System, build_system
from torc.robots.execution import ExecutionConfig

_APPROACH = "motion.cartesian.approach_speed_m_s"
_MARGINS = tuple(f"grasps.checks.{name}_margin_m" for name in ("finger", "palm", "table", "tip"))
WITHOUT_GUARD: Mapping[str, float] = {_APPROACH: 0.05, **dict.fromkeys(_MARGINS, 0.008)}
"""Settings of planning for an arm that feels no contact. With a guard approaches are three times as fast, and objects
keep 3 mm; a camera's pose that is off by 3 mm, which is as much as a calibration may be, touches them then."""
_OWNERS = {"motion": "sampling", "grasps": "geometric"}
"""The planners that have these settings."""


def guarded(system: System, execution: ExecutionConfig) -> tuple[System, str]:
    """Return the system for how its robot feels contact, and a text that says so.

    Without a guard it is built again with the settings `WITHOUT_GUARD`, except for those that the conditions set and
    those that its planners do not have.
    """
    if execution.approach_guard is not None:
        force_n = execution.approach_guard.max_force_n
        return system, f"The robot stops at a contact of {force_n:g} N while it approaches."
    spec = system.conditions
    have = {stage for stage, owner in _OWNERS.items() if getattr(spec, stage) == owner}
    own = {k: v for k, v in WITHOUT_GUARD.items() if k.partition(".")[0] in have}
    settings: dict[str, Any] = {**own, **spec.settings}
    speed, margin = settings.get(_APPROACH), settings.get(_MARGINS[0])
    text = (
        "The robot feels no contact, and nothing but you stops it when it touches something. "
        + _told(speed, "Approaches are slow: {:g} m/s. ", "approaches")
        + _told(margin, "Grasps keep {:g} m from other objects.", "grasps")
    )
    return build_system(replace(spec, settings=settings), system.workspace, system.robot), text.strip()


def _told(value: Any, text: str, what: str) -> str:
    return (
        text.format(value) if value is not None else f"How careful {what} are is their planner's own matter. "
    )
