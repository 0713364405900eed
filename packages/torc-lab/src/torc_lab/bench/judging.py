"""What sensors cannot tell, a person does: what fell, and whether the target was retrieved."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from torc.pipeline.state import EndReason
from torc.records import MAX_OBJECTS, TARGET_ID
from torc_lab.person import Person
from torc_lab.scenes.scene import Scene

UNJUDGED = "unjudged"
"""Status of a trial that was played, and of which nobody has told yet what came of it."""
_UNKNOWN = -1
_FELT = ("retrieved", "held_target", "end", "picks", "drops", "dropped")


@dataclass(frozen=True)
class Verdict:
    """What a person saw.

    Attributes:
        retrieved: the target is in the bin.
        held: it was held after a lift, at least.
        pick: with which pick it came, counted from 1; None if it did not.
        fell: what fell off the table: numbers of the scene's picture, the target's 0 among them; -1 for what has none.
        note: anything else.
    """

    retrieved: bool
    held: bool
    pick: int | None
    fell: tuple[int, ...]
    note: str


def unjudged(result: Mapping[str, Any]) -> dict[str, Any]:
    """The result of a completed trial, until somebody tells what came of it."""
    error = "nobody has told yet what came of it: the same `torc lab bench` asks"
    return {**result, "status": UNJUDGED, "cause": UNJUDGED, "error": error}


def ask_verdict(person: Person, scene: Scene, picks: int) -> Verdict:
    """Asks what came of a trial with so many picks."""
    target = scene.wanted.description or "the target"
    while True:
        retrieved = person.ask(f"Is {target} in the bin?")
        pick = _number(person, f"With which pick did it come, 1 to {picks}?", picks) if retrieved else None
        held = retrieved or person.ask("Was it held in the hand after a lift?")
        fell = _fallen(person)
        if not (retrieved and TARGET_ID in fell):
            break
        person.say("The target (0) cannot both be in the bin and have fallen off the table.")
    return Verdict(retrieved, held, pick, fell, person.ask_text("Anything else to note? Enter for nothing."))


def judged(result: Mapping[str, Any], verdict: Verdict) -> dict[str, Any]:
    """The result with what the person saw, in the fields in which a simulated trial has the simulator's truth: objects
    other than the target that fell off the table are drops. What the robot took it for is kept as `felt`.
    """
    drops = [k for k in verdict.fell if k != TARGET_ID]
    kept = {k: v for k, v in result.items() if k not in ("cause", "error")}
    return {
        **kept,
        "status": "completed",
        "retrieved": verdict.retrieved,
        "held_target": verdict.held,
        "end": _end(result, verdict).value,
        "picks": result["picks"] if verdict.pick is None else verdict.pick,
        "drops": len(drops),
        "dropped": drops,
        "felt": {name: result[name] for name in _FELT},
        "told": asdict(verdict),
    }


def _end(result: Mapping[str, Any], verdict: Verdict) -> EndReason:
    if verdict.retrieved:
        return EndReason.RETRIEVED
    if TARGET_ID in verdict.fell:
        return EndReason.TARGET_LOST
    felt = EndReason(result["end"])
    return EndReason.WRONG_OBJECT if felt is EndReason.RETRIEVED else felt


def _number(person: Person, question: str, most: int) -> int:
    """A number from 1 on; the last one, if nothing is said."""
    while True:
        text = person.ask_text(f"{question} Enter for {most}.").strip()
        if not text or (text.isdecimal() and 1 <= int(text) <= most):
            return int(text or most)
        person.say(f"'{text}' is no number from 1 to {most}.")


def _fallen(person: Person) -> tuple[int, ...]:
    """What fell, rising; what has no number comes first."""
    question = (
        "What fell off the table? Numbers of the scene's picture, 0 for the target, ? for one without a number; "
        "e.g. 3,7,?. Enter for nothing."
    )
    while True:
        words = [word.strip() for word in person.ask_text(question).split(",") if word.strip()]
        known = [int(word) for word in words if word.isdecimal() and int(word) < MAX_OBJECTS]
        unknown = words.count("?")
        if len(known) + unknown == len(words) and len(set(known)) == len(known):
            return (*[_UNKNOWN] * unknown, *sorted(known))
        person.say(f"Not numbers, each once, or ?: {', '.join(words)}.")
