"""Ask a person what sensors cannot see: what fell, and whether the target was retrieved."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from torc.pipeline.state import EndReason
from torc.records import MAX_OBJECTS, TARGET_ID
from torc_lab.person import Person
from torc_lab.scenes.scene import Scene

UNJUDGED = "unjudged"
"""Status of a trial that was played, but whose outcome no person has reported yet."""
_UNKNOWN = -1
_FELT = ("retrieved", "held_target", "end", "picks", "drops", "dropped")


@dataclass(frozen=True)
class Verdict:
    """What a person saw.

    Attributes:
        retrieved: the target is in the bin.
        held: the target was at least held after a lift.
        pick: number of the pick that retrieved it, from 1; None if it was not retrieved.
        fell: numbers, in the scene's picture, of objects that fell off the table: 0 for the target, -1 if unnumbered.
        note: the person's remark.
    """

    retrieved: bool
    held: bool
    pick: int | None
    fell: tuple[int, ...]
    note: str


def unjudged(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the result of a completed trial, marked as not judged yet."""
    error = "nobody has told yet what came of it: the same `torc lab bench` asks"
    return {**result, "status": UNJUDGED, "cause": UNJUDGED, "error": error}


def ask_verdict(person: Person, scene: Scene, picks: int) -> Verdict:
    """Ask the person for the outcome of a trial with `picks` picks."""
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
    """Return the result with the person's verdict in the fields that hold the simulator's truth in a simulated trial.

    Objects other than the target that fell off the table are drops. The robot's own view is kept as `felt`.
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
    """Ask for a number from 1 to `most`; return `most` if the answer is empty."""
    while True:
        text = person.ask_text(f"{question} Enter for {most}.").strip()
        if not text or (text.isdecimal() and 1 <= int(text) <= most):
            return int(text or most)
        person.say(f"'{text}' is no number from 1 to {most}.")


def _fallen(person: Person) -> tuple[int, ...]:
    """Ask which objects fell; return their numbers, ascending, objects without a number (-1) first."""
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
