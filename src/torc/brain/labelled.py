"""What a planner leaves as evidence, in the frame's labels: the one place where ids in plain data are told again.

Translated are the entries that torc's planners share: the dependency graph, the probabilities, what is graspable. Texts
are in labels already (`PlanningContext.called`). What else a planner of somebody's leaves passes as it is.
"""

from collections.abc import Callable, Mapping
from typing import Any

Label = Callable[[Any], Any]
HIDDEN = "hidden"
"""The label of a target that no frame has shown."""


def label_of(labels: Mapping[int, int]) -> Label:
    """Tells the label of an id, given as a number or, as JSON has it for keys, as text; text comes back as text.

    The target's id without a label is HIDDEN; any other id without one stays.
    """

    def label(value: Any) -> Any:
        number = int(value)
        found = labels.get(number, HIDDEN if number == 0 else number)
        return str(found) if isinstance(value, str) else found

    return label


def evidence_in_labels(evidence: Mapping[str, Any], labels: Mapping[int, int]) -> dict[str, Any]:
    """The evidence with the frame's labels for torc's ids."""
    label = label_of(labels)
    told = dict(evidence)
    for key, translate in _TRANSLATED.items():
        if key in told:
            try:
                told[key] = translate(told[key], label)
            except (AttributeError, KeyError, TypeError, ValueError):  # somebody's own, under the same name
                continue
    return told


def _keys(values: Mapping[Any, Any], label: Label) -> dict[Any, Any]:
    return {label(k): v for k, v in values.items()}


def _certainty(values: Mapping[str, Any], label: Label) -> dict[str, Any]:
    return {**values, "upper": _keys(values["upper"], label)}


def _graph(graph: Mapping[str, Any], label: Label) -> dict[str, Any]:
    """As `DependencyGraph.to_dict` makes it."""
    return {
        **graph,
        "target": label(graph["target"]),
        "nodes": [{**node, "id": label(node["id"])} for node in graph["nodes"]],
        "edges": [
            {**edge, "source": label(edge["source"]), "target": label(edge["target"])}
            for edge in graph["edges"]
        ],
    }


_TRANSLATED: Mapping[str, Callable[[Any, Label], Any]] = {
    "graph": _graph,
    "probabilities": _keys,
    "certainty": _certainty,
    "graspable": lambda ids, label: [label(k) for k in ids],
}
