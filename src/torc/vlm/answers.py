"""From a model's reply to what it may mean: an object that was offered, or corrections that the rules allow.

Whatever a reply holds (a misled model, a line of text on an object in the picture), nothing else passes here.
"""

import math
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from torc.task_planning.graph import DependencyEdge, EdgeKind
from torc.vlm.protocol import Finish, Reply

ACTIONS = ("remove", "pick")
_NUMERAL = re.compile(r"\s*(?:object|id)?\s*#?([0-9]{1,3})\s*", re.IGNORECASE)
_MAX_QUOTED = 40
_KINDS = EdgeKind.BEHIND, EdgeKind.BELOW
_Words = Callable[[DependencyEdge], str]
"""Says a relation."""


def _schema(name: str, entry: dict[str, Any]) -> dict[str, Any]:
    """JSON schema of thoughts and then an array; strict modes want all names required and no others."""
    items = {"type": "object", "properties": entry, "required": [*entry], "additionalProperties": False}
    fields = {"thoughts": {"type": "string"}, name: {"type": "array", "items": items}}
    return {"type": "object", "properties": fields, "required": [*fields], "additionalProperties": False}


_ID = {"type": "integer"}
PLAN_SCHEMA = _schema("plan", {"action": {"type": "string", "enum": list(ACTIONS)}, "input": _ID})
"""JSON schema of a sequence of actions."""
RELATIONS_SCHEMA = _schema(
    "relations",
    {"source": _ID, "relation": {"type": "string", "enum": [k.value for k in _KINDS]}, "target": _ID},
)
"""JSON schema of corrected relations."""


@dataclass(frozen=True)
class Useless:
    """A reply that names nothing one can do; the chooser is asked again."""

    reason: str


@dataclass(frozen=True)
class Corrected:
    """Candidate relations after a model's corrections.

    Attributes:
        relations: what is left, in the candidates' order.
        changes: the corrections that were made, in words.
        refused: the entries that the rules do not allow, with the reason.
    """

    relations: tuple[DependencyEdge, ...]
    changes: tuple[str, ...]
    refused: tuple[str, ...]


def read_first_pick(reply: Reply, offered: Collection[int]) -> int | Useless:
    """The object that the first action of a planned sequence names (paper: Approach 1), if it is among those offered.

    The sequence is an array of {"action": "remove" or "pick", "input": id}, alone or under "plan"; ids may be
    written as text ("7", "object 7").
    """
    items = _items(reply, "plan")
    if isinstance(items, Useless):
        return items
    if not items:
        return Useless("It planned no action.")
    first = items[0]
    if not isinstance(first, dict) or "input" not in first:
        return Useless(f"Its first action is not of the form that was asked for: {_quoted(first)}.")
    if first.get("action") not in ACTIONS:
        return Useless(
            f"Its first action is {_quoted(first.get('action'))}, not one of {', '.join(ACTIONS)}."
        )
    chosen = read_id(first["input"])
    if chosen is None:
        return Useless(f"It names {_quoted(first['input'])}, which is no object's number.")
    if chosen not in offered:
        return Useless(f"It names number {chosen}, which is not in sight.")
    return chosen


def read_corrections(
    reply: Reply, candidates: Sequence[DependencyEdge], called: Callable[[int], str] = str
) -> Corrected | Useless:
    """Candidate 'behind' pairs with a model's corrections, as far as the rules allow them (paper: Approach 3).

    It may leave a pair out, or turn "behind" into "below", in either direction. It may add no pair, and turn none
    round that stays "behind". An entry that does not keep to this is refused, and the pair it speaks of, if no
    other entry does, stays as it was. The first of several entries on a pair counts. `called` names an object by its id
    in what is said of the changes.
    """

    def words(relation: DependencyEdge) -> str:
        return f"{called(relation.source)} {relation.kind.value} {called(relation.target)}"

    items = _items(reply, "relations")
    if isinstance(items, Useless):
        return items
    pairs = {frozenset((r.source, r.target)): r for r in candidates}
    stated: dict[frozenset[int], DependencyEdge] = {}
    disputed: set[frozenset[int]] = set()
    refused: list[str] = []
    for item in items:
        relation = _relation(item)
        if isinstance(relation, Useless):
            refused.append(relation.reason)
            continue
        pair = frozenset((relation.source, relation.target))
        fault = _fault(relation, pairs.get(pair), stated.get(pair), words)
        if fault:
            refused.append(f"{words(relation)}: {fault}")
            disputed.add(pair)
        else:
            stated.setdefault(pair, _corrected(pairs[pair], relation, words))
    if items and not stated and not disputed & pairs.keys():
        return Useless(
            f"None of its entries speaks of a pair that was asked about: {'; '.join(refused[:3])}."
        )
    left = tuple(stated.get(p, r) for p, r in pairs.items() if p in stated or p in disputed)
    return Corrected(left, tuple(_changes(pairs, stated, disputed, words)), tuple(refused))


def read_id(value: Any) -> int | None:
    """An object's number from JSON: a whole number, or one written as text; None for anything else."""
    if isinstance(value, str):
        match = _NUMERAL.fullmatch(value)
        return int(match.group(1)) if match else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return int(value) if math.isfinite(value) and value == int(value) else None


def _items(reply: Reply, key: str) -> list[Any] | Useless:
    """The answer's array, alone or under its key; why not, if there is none."""
    if reply.finish is not Finish.COMPLETE:
        return Useless(f"The reply is {reply.finish.value}.")
    answer = reply.answer
    if isinstance(answer, dict):
        answer = answer.get(key)
    if isinstance(answer, list):
        return answer
    return Useless(f'The reply has no JSON array, alone or under "{key}".')


def _relation(item: Any) -> DependencyEdge | Useless:
    if not isinstance(item, dict):
        return Useless(f"{_quoted(item)} is no relation")
    source, target = read_id(item.get("source")), read_id(item.get("target"))
    kind = item.get("relation")
    if source is None or target is None or kind not in _KINDS:
        return Useless(f"{_quoted(item)} is no relation of two objects")
    return DependencyEdge(source, target, EdgeKind(kind))


def _fault(
    relation: DependencyEdge, candidate: DependencyEdge | None, earlier: DependencyEdge | None, words: _Words
) -> str:
    """Why an entry is refused; empty if it is not."""
    if candidate is None:
        return "not a pair that was asked about"
    if earlier is not None:
        same = _direction(earlier) == _direction(relation)
        return "" if same else f"it said before that {words(earlier)}"
    if relation.kind is EdgeKind.BEHIND and relation.source != candidate.source:
        return "a pair may be turned round only when it becomes 'below'"
    return ""


def _corrected(candidate: DependencyEdge, relation: DependencyEdge, words: _Words) -> DependencyEdge:
    """The candidate itself, if nothing was changed; else the relation, the depths having nothing to say on it."""
    if _direction(candidate) == _direction(relation):
        return candidate
    return replace(relation, evidence=MappingProxyType({"corrected_from": words(candidate)}))


def _direction(relation: DependencyEdge) -> tuple[int, int, EdgeKind]:
    return relation.source, relation.target, relation.kind


def _changes(
    pairs: dict[frozenset[int], DependencyEdge],
    stated: dict[frozenset[int], DependencyEdge],
    disputed: set[frozenset[int]],
    words: _Words,
) -> list[str]:
    changes = []
    for pair, before in pairs.items():
        after = stated.get(pair)
        if after is None and pair not in disputed:
            changes.append(f"dropped: {words(before)}")
        elif after is not None and _direction(after) != _direction(before):
            changes.append(f"{words(before)} became {words(after)}")
    return changes


def _quoted(value: Any) -> str:
    """A piece of a reply, short and harmless in a log."""
    try:
        text = ascii(value)
    except RecursionError:
        return f"a deeply nested {type(value).__name__}"
    return text if len(text) <= _MAX_QUOTED else f"{text[:_MAX_QUOTED]}..."
