"""Who competes. A trial says so itself; of older ones, which do not, it is derived from what they tell."""

from collections.abc import Mapping
from typing import Any

from torc.benchmark.spec import SIMULATED
from torc.episode.planners import PRIVILEGED

_HUMAN = "human"


def participated(label: str, facts: Mapping[str, Any], result: Mapping[str, Any]) -> bool:
    """Whether a trial's planner saw no more than planners see.

    Args:
        label: of the planner.
        facts: spec.json.
        result: result.json.
    """
    if label.partition(" ")[0] == _HUMAN and "outside_view" not in facts:
        return False  # the page always showed the outside then
    return bool(result.get("participant", participant_by_name(label)))


def participant_by_name(label: str) -> bool:
    """The same where nothing but the planner's label is known: older tables, trials that gave no result."""
    name, _, model = label.partition("[")
    is_person = label.partition(" ")[0] == _HUMAN
    return not (name in PRIVILEGED or model.startswith(SIMULATED) or is_person)
