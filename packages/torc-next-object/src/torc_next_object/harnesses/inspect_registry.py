"""The data set as tasks of inspect_ai: one question a sample, scored by `torc_next_object.scoring`.

    inspect eval torc_next_object/next_object_image -T data=DIR --model PROVIDER/MODEL

The environment variable TORC_NEXT_OBJECT may also name the data set, and it may be on the Hugging Face hub. The entry
point `inspect_ai` names this module, so it imports the closed loop, too.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from inspect_ai import Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import ChatMessageUser, ContentImage, ContentText
from inspect_ai.scorer import Metric, SampleScore, Score, Scorer, Target, metric, scorer
from inspect_ai.solver import TaskState, generate

from torc.io.pictures import data_url
from torc_next_object.data.opening import open_rows
from torc_next_object.harnesses.inspect_retrieval import retrieval, retrieve, retrieved  # noqa: F401
from torc_next_object.prompting import prompt_digest, prompt_name, prompt_text, sent_pictures, version_of
from torc_next_object.replies import read_number
from torc_next_object.scoring import COLUMNS, Scored, group_regrets, score_answer, summary

_SHOWN = ("regret", "regret_low", "regret_high", "top1", "top1_low", "top1_high", "lost", "invalid")


@task
def next_object_image(data: str | None = None, split: str = "test") -> Task:
    """Which object first, by the marked picture alone."""
    return _task("image", data, split)


@task
def next_object_grasps(data: str | None = None, split: str = "test") -> Task:
    """Which object first, also given what is graspable and what blocks what."""
    return _task("grasps", data, split)


@task
def next_object_relations(data: str | None = None, split: str = "test") -> Task:
    """Which object first, also given what seems to stand behind what."""
    return _task("relations", data, split)


@metric
def next_object_scores() -> Metric:
    """Compute the scores of `torc next-object score`: regret, shares of best choices and invalid replies, intervals."""

    def scores(found: list[SampleScore]) -> dict[str, Any]:
        scored = [_scored(one) for one in found]
        # A row that was asked several times counts by its mean.
        invalid = sum(_value(one)["invalid"] for one in found) / len(found)
        whole = summary(scored).to_dict() | {"invalid": round(invalid, 4)}
        shown = {name: whole[name] for name in _SHOWN}
        shown |= {f"regret_{group}": regret for group, regret in group_regrets(whole).items()}
        return {name: value for name, value in shown.items() if value is not None}

    return scores


@scorer(metrics=[next_object_scores()])
def next_object() -> Scorer:
    """Score a sample's choice by the values in its metadata."""

    async def score(state: TaskState, target: Target) -> Score:
        row: Mapping[str, Any] = state.metadata
        number = read_number(state.output.completion, row["numbers"])
        found = score_answer(row, number)
        value = {
            "regret": math.nan if found.regret is None else found.regret,
            "top1": float(found.top1),
            "lost": found.lost,
            "spread": found.spread,
            "invalid": float(found.number is None),
        }
        best = ", ".join(map(str, row["best"]))
        choice = "no valid choice" if number is None else f"chose {number}"
        return Score(
            value=value,
            answer=None if number is None else str(number),
            explanation=f"{choice}; best: {best}; {found.lost:.2f} of {found.spread:.2f} picks lost",
        )

    return score


def _task(variant: str, data: str | None, split: str) -> Task:
    rows = open_rows(data, split)
    version = version_of(rows[0])
    return Task(
        dataset=MemoryDataset([_sample(row, variant) for row in rows], name=f"torc-next-object {split}"),
        solver=generate(),
        scorer=next_object(),
        metadata={
            "prompt": prompt_name(variant, version),
            "prompt_sha256": prompt_digest(variant, version),
        },
    )


def _sample(row: Mapping[str, Any], variant: str) -> Sample:
    pictures = [ContentImage(image=data_url(picture)) for picture in sent_pictures(row)]
    text = ContentText(text=prompt_text(row, variant))
    return Sample(
        id=str(row["id"]),
        input=[ChatMessageUser(content=[*pictures, text])],
        target=[str(number) for number in row["best"]],
        # No model sees these.
        metadata={name: row[name] for name in (*COLUMNS, "best")},
    )


def _scored(one: SampleScore) -> Scored:
    """Return a sample's score, or the mean of several epochs."""
    value, row = _value(one), dict(one.sample_metadata or {})
    number = None if value["invalid"] else int(row["numbers"][0])
    return replace(score_answer(row, None), number=number, lost=value["lost"], top1=value["top1"])


def _value(one: SampleScore) -> Mapping[str, Any]:
    return one.score.as_dict()
