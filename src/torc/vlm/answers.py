"""Read a model's reply: an object that was offered, or corrections that the rules allow.

Nothing else passes, whatever the reply holds (a misled model, text on an object in the picture). A number may be
written 6, 6.0, "6", "object 6", "object_6", "#6", or [6].
"""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from torc.records.graph import DependencyEdge, EdgeKind
from torc.vlm.protocol import Finish, Reply

NAMES = r"(?:object|obj|id|number|no\.)"
"""Words that models put before a number."""
_NUMERAL = re.compile(rf"[\s\"'`]*(?:{NAMES}[\s_:]*)?#?([0-9]{{1,3}})[\s\"'`]*", re.IGNORECASE)
ACTIONS = ("remove", "pick")
_CHOICE_KEYS = ("object", "object_id", "number", "answer", "choice")
"""Names under which models give a single object instead of a plan."""
_FENCE = "```json"
_MAX_QUOTED = 40
_KINDS = EdgeKind.BEHIND, EdgeKind.BELOW


def _schema(name: str, entry: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of thoughts followed by an array. Strict modes require every name, and no others."""
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
    """A reply that names nothing that can be done; the model is asked again."""

    reason: str


@dataclass(frozen=True)
class Corrected:
    """Candidate relations after a model's corrections.

    Attributes:
        relations: the relations, in the candidates' order.
        changes: the corrections that were made, in words.
        refused: entries that the rules do not allow, with the reason.
    """

    relations: tuple[DependencyEdge, ...]
    changes: tuple[str, ...]
    refused: tuple[str, ...]


def read_first_pick(reply: Reply, offered: Collection[int]) -> int | Useless:
    """Return the object that the first action of a planned sequence names (paper: Approach 1), if it was offered.

    The sequence is an array of {"action": "remove" or "pick", "input": id}, alone or under "plan". A reply that is a
    single object, e.g. "object_6", [6] or {"object": 6}, names that object.
    """
    named = _first_named(reply)
    if isinstance(named, Useless):
        return named
    chosen = whole_number(named)
    if chosen is None:
        return Useless(f"It names {_quoted(named)}, which is no object's number.")
    if chosen not in offered:
        return Useless(f"It names number {chosen}, which is not in sight.")
    return chosen


def _first_named(reply: Reply) -> Any:
    """Return what the first action names, or the reply itself if it is a single object; Useless otherwise."""
    if reply.finish is Finish.COMPLETE and (alone := _lone_choice(reply)) is not None:
        return alone
    items = _items(reply, "plan")
    if isinstance(items, Useless):
        return items
    if not items:
        return Useless("It planned no action.")
    first = items[0]
    if len(items) == 1 and whole_number(first) is not None:
        return first
    if not isinstance(first, dict) or "input" not in first:
        return Useless(f"Its first action is not of the form that was asked for: {_quoted(first)}.")
    if first.get("action") not in ACTIONS:
        return Useless(
            f"Its first action is {_quoted(first.get('action'))}, not one of {', '.join(ACTIONS)}."
        )
    return first["input"]


def _lone_choice(reply: Reply) -> Any:
    """Return the single object of a reply without a plan; None if it names none or several."""
    if reply.answer is None:
        return number_in_text(reply.text.strip().removeprefix(_FENCE).strip())
    if not isinstance(reply.answer, dict) or not {"plan", "action", "relations"}.isdisjoint(reply.answer):
        return None
    given = [reply.answer[key] for key in _CHOICE_KEYS if key in reply.answer]
    return given[0] if len(given) == 1 else None


def read_corrections(
    reply: Reply, candidates: Sequence[DependencyEdge], called: Callable[[int], str] = str
) -> Corrected | Useless:
    """Apply a model's corrections to the candidate 'behind' pairs, as far as the rules allow (paper: Approach 3).

    The model may drop a pair, or turn "behind" into "below" in either direction. It may not add a pair, nor reverse one
    that stays "behind". A pair whose only entry is refused is unchanged. Of several entries on a pair the first counts.

    Args:
        reply: the model's reply.
        candidates: the pairs that it was given.
        called: names an object by its id, for the list of changes.
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
        if relation is None:
            refused.append(f"{_quoted(item)} is no relation of two objects")
            continue
        pair = frozenset((relation.source, relation.target))
        before, earlier = pairs.get(pair), stated.get(pair)
        if before is None:
            fault = "not a pair that was asked about"
        elif earlier is not None:
            fault = "" if _same(earlier, relation) else f"it said before that {words(earlier)}"
        elif relation.kind is EdgeKind.BEHIND and relation.source != before.source:
            fault = "a pair may be turned round only when it becomes 'below'"
        else:
            fault = ""
            # The candidate's evidence, its depths, does not apply to a corrected relation.
            changed = replace(relation, evidence={"corrected_from": words(before)})
            stated[pair] = before if _same(before, relation) else changed
        if fault:
            refused.append(f"{words(relation)}: {fault}")
            disputed.add(pair)
    if items and not stated and not disputed & pairs.keys():
        return Useless(
            f"None of its entries speaks of a pair that was asked about: {'; '.join(refused[:3])}."
        )
    left, changes = [], []
    for pair, before in pairs.items():
        if pair not in stated and pair not in disputed:
            changes.append(f"dropped: {words(before)}")
            continue
        left.append(stated.get(pair, before))
        if not _same(left[-1], before):
            changes.append(f"{words(before)} became {words(left[-1])}")
    return Corrected(tuple(left), tuple(changes), tuple(refused))


def _items(reply: Reply, key: str) -> list[Any] | Useless:
    """Return the answer's array, alone or under its key; Useless with the reason if there is none."""
    if reply.finish is not Finish.COMPLETE:
        return Useless(f"The reply is {reply.finish.value}.")
    answer = reply.answer
    if isinstance(answer, dict):
        answer = answer.get(key)
    if isinstance(answer, list):
        return answer
    return Useless(f'The reply has no JSON array, alone or under "{key}".')


def _relation(item: Any) -> DependencyEdge | None:
    if not isinstance(item, dict):
        return None
    source, target, kind = (
        whole_number(item.get("source")),
        whole_number(item.get("target")),
        item.get("relation"),
    )
    if source is None or target is None or kind not in _KINDS:
        return None
    return DependencyEdge(source, target, EdgeKind(kind))


def _same(a: DependencyEdge, b: DependencyEdge) -> bool:
    return (a.source, a.target, a.kind) == (b.source, b.target, b.kind)


def _quoted(value: Any) -> str:
    """Quote a piece of a reply, short and safe for a log."""
    try:
        text = ascii(value)
    except RecursionError:
        return f"a deeply nested {type(value).__name__}"
    return text if len(text) <= _MAX_QUOTED else f"{text[:_MAX_QUOTED]}..."


def number_in_text(text: str) -> int | None:
    """Return the number in a text that is a number, alone or after a word like "object"; None for any other text."""
    match = _NUMERAL.fullmatch(text)
    return int(match.group(1)) if match else None


def whole_number(value: Any) -> int | None:
    """Return the whole number in a JSON value: a number, a text, or a list of one of these. None for anything else.

    Negative numbers stay negative.
    """
    if isinstance(value, list) and len(value) == 1 and not isinstance(value[0], list):
        value = value[0]
    if isinstance(value, str):
        return number_in_text(value)
    whole = type(value) is int or (type(value) is float and value.is_integer())
    return int(value) if whole else None
