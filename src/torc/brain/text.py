"""An answer in words: the choice, how to grasp it, why, and a row per object. All objects go by the frame's labels."""

import textwrap

from torc.brain.answer import Answer
from torc.brain.candidates import FATES, blockers_of, grasp_fates
from torc.errors import InputError
from torc.records import TARGET_ID, GraspStatus
from torc.task_planning.drawing import by_id

_WIDTH = 80
_TIE = "\N{NO-BREAK SPACE}"
"""Between words that stay on one line."""


def answer_text(answer: Answer) -> str:
    """Some lines for people."""
    chosen = answer.decision.object_id
    choice = "No choice." if chosen is None else f"Pick object {_called(answer, chosen)}."
    lines = [choice, *_wrapped(f"Why: {answer.decision.reason}")]
    if answer.grasps:
        lines += _wrapped(_best_grasp(answer))
    lines += _wrapped(_target(answer))
    if answer.look.context.scene.objects:
        lines += ["", *_why_not(answer)] if chosen is None else ["", *_table(answer), "", *_legend(answer)]
    if answer.left_out:
        labels = ", ".join(map(str, answer.left_out))
        lines += _wrapped(f"Left out, for too few pixels or readings of depth: {labels}.")
    return "\n".join(lines).replace(_TIE, " ")


def _column(head: str, *cells: str) -> list[str]:
    """Heading and a cell per object in sight, all equally long: words to the left, numbers to the right."""
    width = max(map(len, (head, *cells)))
    words = head in ("", "name", "blocked by")
    return [text.ljust(width) if words else text.rjust(width) for text in (head, *cells)]


def _wrapped(text: str, indent: str = "") -> list[str]:
    return textwrap.wrap(text, _WIDTH, subsequent_indent=indent, break_long_words=False)


def _called(answer: Answer, object_id: int) -> str:
    name = f" ({answer.names[object_id]})" if object_id in answer.names else ""
    return f"{answer.labels[object_id]}{name}"


def _best_grasp(answer: Answer) -> str:
    best, count = answer.grasps[0], len(answer.grasps)
    x, y, z = best.T_world_tcp[:3, 3]
    more = f"its pose and {count - 1} more" if count > 1 else "its pose"
    return (
        f"Best grasp: at ({x:.3f}, {y:.3f}, {z:.3f}) m, {1000 * best.width_m:.0f} mm wide, succeeds with "
        f"p = {best.p:.2f}; {more}: --json."
    )


def _target(answer: Answer) -> str:
    scene = answer.look.context.scene
    if scene.target_id is not None:
        target = f"object {_called(answer, scene.target_id)}, in sight"
    elif TARGET_ID in answer.labels:
        target = f"object {answer.labels[TARGET_ID]}, shows too little to be found and counts as hidden"
    else:
        target = "hidden"
    return f"The target is {target}. Objects in sight: {len(scene.objects)}."


def _why_not(answer: Answer) -> list[str]:
    """Per object what became of its grasps."""
    lines = ["What became of the grasps of each object:"]
    for k in answer.ids:
        told = []
        for fate, n in grasp_fates(answer.look.context, k).items():
            by = f", by {_blockers(answer, k)}" if fate is GraspStatus.BLOCKED else ""
            told.append(f"{n} {FATES[fate]}{by}")
        fates = f"{'; '.join(told)}." if told else "no grasp was found"
        lines += _wrapped(f"  {_called(answer, k)}: {fates}", "    ")
    return lines


def _blockers(answer: Answer, object_id: int) -> str:
    """Who blocks grasps of the object, the most important first; in brackets how many."""
    blockers = sorted(blockers_of(answer.look.context, object_id).items(), key=lambda item: -item[1])
    return ", ".join(f"{answer.labels[k]}{_TIE}({n})" for k, n in blockers)


def _probabilities(answer: Answer) -> dict[int, float]:
    """By object id; empty where the planner gives none that can be read."""
    try:
        return by_id(answer.decision.evidence.get("probabilities"))
    except InputError:
        return {}


def _table(answer: Answer) -> list[str]:
    """A row per object in sight, the chosen one marked; the last column is wrapped."""
    chosen = answer.decision.object_id
    marks = [" ", *(">" if k == chosen else " " for k in answer.ids)]
    lines = []
    for mark, (*row, last) in zip(marks, zip(*_columns(answer))):
        start = f" {mark} {'  '.join(row)}  "
        room = max(_WIDTH - len(start), 20)
        first, *more = textwrap.wrap(last, room) or [""]
        lines += [(start + first).rstrip(), *(" " * len(start) + text for text in more)]
    return lines


def _columns(answer: Answer) -> list[list[str]]:
    context, ids, p = answer.look.context, answer.ids, _probabilities(answer)
    valid = dict(zip(context.report.object_ids, context.report.valid_total.tolist()))
    columns = [_column("object", *(str(answer.labels[k]) for k in ids))]
    if answer.names:
        columns.append(_column("name", *(answer.names.get(k, "-") for k in ids)))
    if context.scene.target_id is not None:
        columns.append(_column("", *("target" if k == context.scene.target_id else "" for k in ids)))
    columns.append(_column("grasps", *(str(valid[k]) for k in ids)))
    columns.append(_column("hides", *(f"{1000 * context.volume.hidden_volume_m3(k):.1f} l" for k in ids)))
    if p:
        columns.append(_column("p", *(f"{p[k]:.2f}" if k in p else "-" for k in ids)))
    columns.append(_column("blocked by", *(_blockers(answer, k) or "-" for k in ids)))
    return columns


def _legend(answer: Answer) -> list[str]:
    lines = _wrapped(
        "grasps: those that can be tried now. hides: the unseen space behind it. blocked by: object (grasps that it "
        "blocks)."
    )
    if _probabilities(answer):
        lines += _wrapped(
            "p: how probably picking it makes way for the target; - where other things have to go first."
        )
    return lines
