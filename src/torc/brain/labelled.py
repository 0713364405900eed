"""What a planner leaves as evidence, in the frame's labels instead of torc's ids.

Translated are the entries that torc's planners share: the dependency graph, the probabilities, what is graspable. Texts
are in labels already (`PlanningContext.called`). What else a user's planner leaves passes as it is.
"""

from collections.abc import Callable, Mapping
from typing import Any

HIDDEN = "hidden"
"""The label of a target that no frame has shown."""


def evidence_in_labels(evidence: Mapping[str, Any], labels: Mapping[int, int]) -> dict[str, Any]:
    """The evidence with the frame's labels for torc's ids; ids that are text, as keys in JSON, stay text."""

    def label(value: Any) -> Any:
        number = int(value)
        found = labels.get(number, HIDDEN if number == 0 else number)
        return str(found) if isinstance(value, str) else found

    def keys(values: Mapping[Any, Any]) -> dict[Any, Any]:
        return {label(k): v for k, v in values.items()}

    def graph(data: Mapping[str, Any]) -> dict[str, Any]:
        nodes = [{**n, "id": label(n["id"])} for n in data["nodes"]]
        edges = [{**e, "source": label(e["source"]), "target": label(e["target"])} for e in data["edges"]]
        return {**data, "target": label(data["target"]), "nodes": nodes, "edges": edges}

    translations: dict[str, Callable[[Any], Any]] = {
        "graph": graph,
        "probabilities": keys,
        "certainty": lambda values: {**values, "upper": keys(values["upper"])},
        "graspable": lambda ids: [label(k) for k in ids],
    }
    told = dict(evidence)
    for key in told.keys() & translations.keys():
        try:
            told[key] = translations[key](told[key])
        except (AttributeError, KeyError, TypeError, ValueError):  # a user's own data under the same name
            continue
    return told
