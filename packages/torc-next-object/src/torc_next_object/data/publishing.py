"""Write the files beside the rows: the card, the hub's evaluation file, and replies with their scores."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from torc.io.results import write_json
from torc_next_object.data.tables import DATA
from torc_next_object.replies import read_number
from torc_next_object.schema import FORMAT, NAME, NextObjectRow
from torc_next_object.scoring import COLUMNS, score_answers, score_baselines, scores_table

REFERENCE = "reference.json"
_REFERENCE_ROWS = 12
REPLIES = (
    "Answer: {best}",
    "{last} stands before it.\n\n**Answer: {last}**",
    '```json\n{{"thoughts": "?", "plan": [{{"action": "remove", "input": {last}}}]}}\n```',
    "",
    "I cannot help with that.",
    "Answer: 99",
    "{best}",
    "Answer: {best} or {last}",
    "<think>{last}?</think>\nThe answer is {best}.",
    "[{best}, {last}]",
    "Answer: -1",
    '{{"answer": "object {best}"}}',
)
"""Texts that models write, odd ones too."""
_TEMPLATE = """{prompt}

The picture is what the camera of a robot arm sees; each object carries a number. The robot is to fetch the target.
The target's number is 0; if 0 is not among the numbers in sight, the target is hidden. Numbers in sight: {numbers}.
{facts}

Which object should the robot take first, so that it needs as few picks as possible? End with a line "Answer: N"."""


def publish(directory: Path, rows: Sequence[NextObjectRow], hidden: bool = False) -> None:
    """Write the files beside the rows; for a hidden set only the card."""
    (directory / "README.md").write_text(card(rows), encoding="utf-8")
    if not hidden:
        (directory / "eval.yaml").write_text(
            yaml.safe_dump(hub_evaluation(), sort_keys=False), encoding="utf-8"
        )
        write_json(directory / REFERENCE, reference(rows))


def reference(rows: Sequence[NextObjectRow]) -> dict[str, Any]:
    """Return rows without pictures, a reply to each, the number that it names, and the scores, to test harnesses by."""
    chosen = sorted(rows, key=lambda row: row.id)[:_REFERENCE_ROWS]
    plain = [{name: row.to_dict()[name] for name in COLUMNS} for row in chosen]
    replies = {
        row.id: REPLIES[i % len(REPLIES)].format(best=row.best[0], last=row.numbers[-1])
        for i, row in enumerate(chosen)
    }
    named = {row.id: read_number(replies[row.id], row.numbers) for row in chosen}
    scores = score_answers((row, named[row["id"]]) for row in plain)
    return {"format": FORMAT, "rows": plain, "replies": replies, "numbers": named, "scores": scores.to_dict()}


def hub_evaluation() -> dict[str, Any]:
    """Return eval.yaml, by which the hub evaluates with inspect_ai whether an answer is among the best."""
    task = {
        "id": "next_object",
        "config": "default",
        "split": "test",
        "field_spec": {
            "input": "description",
            "input_image": "image",
            "target": "best",
            "metadata": ["numbers", "facts"],
        },
        "solvers": [{"name": "prompt_template", "args": {"template": _TEMPLATE}}, {"name": "generate"}],
        "scorers": [{"name": "pattern", "args": {"pattern": r"(?i)answer\s*:\s*\**(\d+)"}}],
    }
    return {
        "name": NAME,
        "description": "Which object to remove first, to get at a target in clutter with the fewest picks.",
        "evaluation_framework": "inspect-ai",
        "tasks": [task],
    }


def card(rows: Sequence[NextObjectRow]) -> str:
    """Return README.md with the hub's header."""
    splits = {split: [r for r in rows if r.split == split] for split in sorted({r.split for r in rows})}
    files = [{"split": split, "path": f"{DATA}/{split}.parquet"} for split in splits]
    header = {
        "license": "mit",
        "pretty_name": "torc next object",
        "task_categories": ["visual-question-answering", "robotics"],
        "language": ["en"],
        "size_categories": ["n<1K" if len(rows) < 1000 else "1K<n<10K"],
        "configs": [{"config_name": "default", "data_files": files}],
    }
    lines = ["| split | decisions | problems | target hidden |", "|---|---|---|---|"]
    for split, some in splits.items():
        hidden = sum(r.target_hidden for r in some)
        lines.append(f"| {split} | {len(some)} | {len({r.scene for r in some})} | {hidden} |")
    head = f"---\n{yaml.safe_dump(header, sort_keys=False)}---\n"
    scores = scores_table(score_baselines([row.to_dict() for row in rows]))
    return "\n".join([head, _ABOUT, *lines, _SCORES, scores]) + "\n"


_ABOUT = """# torc-next-object

A robot arm is to fetch a target out of clutter; often nothing of it is in sight. Which object should it take first?
Each row is one such decision, with the expected number of picks after **every** choice, so that an answer can be scored
without a simulator. Made with [torc](https://pypi.org/project/torc-retrieval/) in MuJoCo; MIT licence.
"""
_SCORES = """
Regret is the picks that an answer loses, over those that a random graspable object loses: 0 best, 1 random. An answer
that names no visible number counts as a random one. Scores on all rows of simple choices, planners that ask no model,
and torc's simulated VLM at five accuracies:
"""
