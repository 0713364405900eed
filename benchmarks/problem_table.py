"""Tables of the problems of a set: how hard each is, and how each planner does on it (`retrieval.py --per-problem`)."""

from collections.abc import Mapping, Sequence

import numpy as np

from intervals import RETRIEVED, WITH_NO_DROP, mean, median
from torc.generation.batch import inspector_for
from torc.generation.difficulty import Difficulty, difficulty_of
from torc.scenes.problem import Problem

ROBOT = "sda10f_2f85"


def difficulties(problems: Mapping[str, Problem]) -> dict[str, Difficulty]:
    """How hard each problem is: as its file states it, else measured."""
    return {name: difficulty_of(problem, inspector_for(ROBOT)) for name, problem in problems.items()}


def facts_table(problems: Mapping[str, Problem], facts: Mapping[str, Difficulty]) -> str:
    """What the problems are like, structured and unstructured ones apart. Medians with the range in brackets."""
    lines = [
        "| scenes | problems | objects | targets visible / partly / hidden | % in sight | in front | beside | taller |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for category in ("all", "structured", "unstructured"):
        mine = [facts[name] for name, problem in problems.items() if category in ("all", problem.category)]
        if not mine:
            continue
        groups = " / ".join(
            str(sum(d.hiddenness.value == group for d in mine)) for group in ("visible", "partly", "hidden")
        )
        cells = [
            _with_range([d.objects for d in mine]),
            groups,
            _with_range([100 * d.visible_fraction for d in mine]),
            *(_with_range([getattr(d, name) for d in mine]) for name in ("in_front", "beside", "taller")),
        ]
        lines.append(f"| {category} | {len(mine)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def problem_table(
    rows: Sequence[Mapping],
    planners: Sequence[str],
    problems: Mapping[str, Problem],
    facts: Mapping[str, Difficulty],
) -> str:
    """A row per problem. Of each planner: median picks with their range, then shares and mean over its trials."""
    columns = ["problem", "scene", "objects", "% in sight", "target"]
    for planner in planners:
        columns += [f"{planner}: picks", "retrieved", "with no drop", "drops"]
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for name, problem in problems.items():
        d = facts[name]
        cells = [problem.name, problem.category, str(d.objects)]
        cells += [f"{100 * d.visible_fraction:.0f}", d.hiddenness.value]
        for planner in planners:
            done = [
                dict(r)
                for r in rows
                if (r["problem"], r["planner"], r["status"]) == (name, planner, "completed")
            ]
            cells += _results(done)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _results(done: list[dict]) -> list[str]:
    if not done:
        return [""] * 4
    picks = [r["picks"] for r in done]
    return [
        f"{median('picks')(done):g} ({min(picks)}-{max(picks)})",
        f"{RETRIEVED(done):.2f}",
        f"{WITH_NO_DROP(done):.2f}",
        f"{mean('drops')(done):.2f}",
    ]


def _with_range(values: Sequence[float]) -> str:
    return f"{np.median(values):.3g} ({min(values):.0f}-{max(values):.0f})"
