"""An answer in words: the choice, why, and a row per object.

Planners, pictures and logs speak of torc's own numbers (the target is 0). Where the frame's labels are others, both
stand side by side, and the choice is given by its label.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from torc.brain.answer import Answer
from torc.errors import InputError
from torc.records import TARGET_ID
from torc.task_planning.drawing import by_id


def answer_text(answer: Answer) -> str:
    """Some lines for people."""
    lines = [_choice(answer), f"Why: {answer.decision.reason}", _target(answer)]
    if answer.look.context.scene.objects:
        lines += ["", *_table(answer), "", *_legend(answer)]
    if answer.left_out:
        labels = ", ".join(map(str, answer.left_out))
        lines.append(f"Left out, for too few pixels or readings of depth: label {labels}.")
    return "\n".join(lines)


@dataclass(frozen=True)
class _Column:
    """Heading and a cell per object in sight."""

    head: str
    cells: Sequence[str]
    words: bool = False

    def lines(self) -> list[str]:
        """Heading and cells, all equally long: words to the left, numbers to the right."""
        texts = (self.head, *self.cells)
        width = max(map(len, texts))
        return [t.ljust(width) if self.words else t.rjust(width) for t in texts]


def _renumbered(answer: Answer) -> bool:
    """Whether some object in sight has another number here than in the frame."""
    return any(answer.labels[k] != k for k in answer.look.context.scene.ids)


def _choice(answer: Answer) -> str:
    chosen = answer.decision.object_id
    if chosen is None:
        return "No choice."
    what = "label" if _renumbered(answer) else "object"
    name = f" ({answer.names[chosen]})" if chosen in answer.names else ""
    number = "" if chosen == answer.label else f", which is number {chosen} in what follows"
    return f"Pick {what} {answer.label}{name}{number}."


def _target(answer: Answer) -> str:
    scene = answer.look.context.scene
    if scene.target_id is not None:
        target = "in sight"
    elif TARGET_ID in answer.labels:
        target = f"label {answer.labels[TARGET_ID]}, shows too little to be found and counts as hidden"
    else:
        target = "hidden"
    return f"The target is {target}. Objects in sight: {len(scene.objects)}."


def _probabilities(answer: Answer) -> dict[int, float]:
    """By object id; empty where the planner gives none that can be read."""
    try:
        return by_id(answer.decision.evidence.get("probabilities"))
    except InputError:
        return {}


def _table(answer: Answer) -> list[str]:
    """A row per object in sight, the chosen one marked."""
    chosen = answer.decision.object_id
    marks = [" ", *(">" if k == chosen else " " for k in answer.look.context.scene.ids)]
    rows = zip(*(column.lines() for column in _columns(answer)))
    return [f" {mark} {'  '.join(row)}".rstrip() for mark, row in zip(marks, rows)]


def _columns(answer: Answer) -> list[_Column]:
    context, ids = answer.look.context, answer.look.context.scene.ids
    report, p = context.report, _probabilities(answer)
    blocked_by = [", ".join(f"{b} ({n})" for b, n in zip(ids, row) if n) for row in report.blocking.tolist()]
    if _renumbered(answer):
        columns = [
            _Column("number", [str(k) for k in ids]),
            _Column("label", [str(answer.labels[k]) for k in ids]),
        ]
    else:
        columns = [_Column("object", [str(k) for k in ids])]
    if answer.names:
        columns.append(_Column("name", [answer.names.get(k, "-") for k in ids], words=True))
    columns += [
        _Column("valid grasps", [str(n) for n in report.valid_total.tolist()]),
        _Column("hides", [f"{1000 * context.volume.hidden_volume_m3(k):.1f} l" for k in ids]),
    ]
    if p:
        columns.append(_Column("p", [f"{p[k]:.2f}" if k in p else "-" for k in ids]))
    columns.append(_Column("blocked by", [text or "-" for text in blocked_by], words=True))
    columns.append(_Column("", ["target" if k == context.scene.target_id else "" for k in ids], words=True))
    return columns


def _legend(answer: Answer) -> list[str]:
    lines = []
    if _renumbered(answer):
        lines.append(
            "number: torc's own, as in the reason, the pictures and JSON; 0 is the target. label: yours."
        )
    lines.append("hides: the unseen space behind it. blocked by: number (grasps that it blocks).")
    if _probabilities(answer):
        lines.append(
            "p: how probably picking it makes way for the target; - where other things have to go first."
        )
    return lines
