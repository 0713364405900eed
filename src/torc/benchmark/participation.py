"""Who competes. A trial says so itself; of older ones, which do not, it is derived from what they tell."""

from collections.abc import Mapping
from typing import Any

from torc.episode.planners import PRIVILEGED
from torc.specs.trial import SIMULATED, PlannerSpec

_HUMAN = "human"


def participated(planner: PlannerSpec, result: Mapping[str, Any]) -> bool:
    """Whether a trial's planner saw no more than planners see.

    Args:
        planner: who chose.
        result: result.json.
    """
    return not planner.outside_view and bool(result.get("participant", participant_by_name(planner.label)))


def participant_by_name(label: str) -> bool:
    """The same where nothing but the planner's label is known: older tables, trials that gave no result."""
    name, _, model = label.partition("[")
    is_person = label.partition(" ")[0] == _HUMAN
    return not (name in PRIVILEGED or model.startswith(SIMULATED) or is_person)
