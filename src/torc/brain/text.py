"""An answer in words: the choice, how to grasp it, why, and a row per object. Objects go by the frame's labels."""

import textwrap

from torc.brain.answer import STATUS_WORDS, Answer, Sought, blockers_of, status_counts
from torc.records import TARGET_ID, GraspStatus

_WIDTH = 80
_DOUBTFUL = 0.6
"""Masks below this sureness are mentioned."""
_WORTH_TELLING = 0.05
"""Targets below this probability are not mentioned."""
_ESTIMATED = (
    "The camera's pose was estimated: the largest plane in the picture is taken for a level support, at z = 0; the "
    "origin lies below the camera, x where it looks. Positions are in that world, not in a robot's."
)
_NOT_FOUND = {
    Sought.NOTHING: "Nothing tells which object it is: add --reference PICTURE, --mark COLUMN,ROW, or --description "
    "with --vlm, a model that reads it.",
    Sought.PICTURES: "No mask looks enough like the reference pictures.",
    Sought.WORDS: "No mask was taken for what the description says.",
}
"""By how perception looked for the target."""
_TIE = "\N{NO-BREAK SPACE}"
"""Joins words that must stay on one line."""


def answer_text(answer: Answer) -> str:
    """Return the answer as lines of text for people."""
    chosen = answer.decision.object_id
    choice = "No choice." if chosen is None else f"Pick object {_called(answer, chosen)}."
    lines = [choice, *_wrapped(f"Why: {answer.decision.reason}")]
    if answer.grasps:
        best, count = answer.grasps[0], len(answer.grasps)
        x, y, z = best.T_world_tcp[:3, 3]
        lines += _wrapped(
            f"Best grasp: at ({x:.3f}, {y:.3f}, {z:.3f}) m, {1000 * best.width_m:.0f} mm wide, succeeds with "
            f"p = {best.p:.2f}; its pose{f' and {count - 1} more' if count > 1 else ''}: --json."
        )
    scene = answer.look.context.scene
    if scene.target_id is not None:
        p = answer.target_p.get(scene.target_id)
        how_sure = "" if p is None else f" (p = {p:.2f})"
        target = f"object {_called(answer, scene.target_id)}{how_sure}, in sight"
    elif TARGET_ID in answer.labels:
        target = f"object {answer.labels[TARGET_ID]}, shows too little to be found and counts as hidden"
    else:
        target = "hidden"
    lines += _wrapped(f"The target is {target}. Objects in sight: {len(scene.objects)}.")
    if scene.target_id is None and answer.sought in _NOT_FOUND:
        lines += _wrapped(_NOT_FOUND[answer.sought] + _likeliest(answer))
    if answer.sureness:
        lines += _wrapped(_eyes(answer))
    if answer.pose_estimated:
        lines += _wrapped(_ESTIMATED)
    for warning in answer.warnings:
        lines += _wrapped(f"Warning: {warning}")
    if scene.objects:
        lines += ["", *(_why_not(answer) if chosen is None else _table(answer))]
    if answer.left_out:
        labels = ", ".join(map(str, answer.left_out))
        lines += _wrapped(f"Left out, for too few pixels or readings of depth: {labels}.")
    return "\n".join(lines).replace(_TIE, " ")


def _likeliest(answer: Answer) -> str:
    """Name the object that is most probably the target, if perception was not sure enough."""
    p = {k: v for k, v in answer.target_p.items() if k in answer.ids and v >= _WORTH_TELLING}
    best = max(p, key=lambda k: p[k], default=None)
    return "" if best is None else f" Likeliest is object {_called(answer, best)} (p = {p[best]:.2f})."


def _eyes(answer: Answer) -> str:
    """Say which perception found the objects, and which masks it doubts."""
    sure = {k: answer.sureness[k] for k in answer.ids}
    doubtful = [k for k in sorted(sure, key=lambda k: sure[k]) if sure[k] < _DOUBTFUL]
    told = ", ".join(f"{_called(answer, k)} ({sure[k]:.2f})" for k in doubtful[:8])
    return f"The masks were found by torc (perception: {answer.eyes}). " + (
        f"It is not sure of {told}." if told else "It doubts none of them."
    )


def _wrapped(text: str, indent: str = "") -> list[str]:
    return textwrap.wrap(text, _WIDTH, subsequent_indent=indent, break_long_words=False)


def _called(answer: Answer, object_id: int) -> str:
    name = f" ({answer.names[object_id]})" if object_id in answer.names else ""
    return f"{answer.labels[object_id]}{name}"


def _why_not(answer: Answer) -> list[str]:
    """Return lines that say, per object, what happened to its grasps."""
    lines = ["What became of the grasps of each object:"]
    for k in answer.ids:
        told = []
        for status, n in status_counts(answer.look.context, k).items():
            by = f", by {_blockers(answer, k)}" if status is GraspStatus.BLOCKED else ""
            told.append(f"{n} {STATUS_WORDS[status]}{by}")
        ends = f"{'; '.join(told)}." if told else "no grasp was found"
        lines += _wrapped(f"  {_called(answer, k)}: {ends}", "    ")
    return lines


def _blockers(answer: Answer, object_id: int) -> str:
    """Name the objects that block grasps of this one, most important first, with the number of grasps in brackets."""
    blockers = sorted(blockers_of(answer.look.context, object_id).items(), key=lambda item: -item[1])
    return ", ".join(f"{answer.labels[k]}{_TIE}({n})" for k, n in blockers)


def _table(answer: Answer) -> list[str]:
    """Return a row per object in sight, the chosen one marked, the last column wrapped, and a legend below."""
    context, ids = answer.look.context, answer.ids
    valid = dict(zip(context.report.object_ids, context.report.valid_total.tolist()))
    p = answer.decision.evidence.probabilities
    columns = [["object", *(str(answer.labels[k]) for k in ids)]]
    if answer.names:
        columns.append(["name", *(answer.names.get(k, "-") for k in ids)])
    if context.scene.target_id is not None:
        columns.append(["", *("target" if k == context.scene.target_id else "" for k in ids)])
    columns.append(["grasps", *(str(valid[k]) for k in ids)])
    columns.append(["hides", *(f"{1000 * context.volume.hidden_volume_m3(k):.1f} l" for k in ids)])
    if p:
        columns.append(["p", *(f"{p[k]:.2f}" if k in p else "-" for k in ids)])
    for i, column in enumerate(columns):
        width = max(map(len, column))
        columns[i] = [
            cell.ljust(width) if column[0] in ("", "name") else cell.rjust(width) for cell in column
        ]
    last = ["blocked by", *(_blockers(answer, k) or "-" for k in ids)]
    lines = []
    for k, row, blockers in zip((None, *ids), zip(*columns), last):
        start = f" {'>' if k is not None and k == answer.decision.object_id else ' '} {'  '.join(row)}  "
        first, *more = textwrap.wrap(blockers, max(_WIDTH - len(start), 20))
        lines += [start + first, *(" " * len(start) + text for text in more)]
    legend = "hides: the unseen space behind it. blocked by: object (grasps that it blocks)."
    lines += ["", *_wrapped(f"grasps: those that can be tried now. {legend}")]
    if p:
        lines += _wrapped(
            "p: how probably picking it makes way for the target; - where other things have to go first."
        )
    return lines
