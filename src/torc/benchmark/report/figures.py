"""The figures: the paper's 9 and 10 from our trials, with the paper's own values beside them, and three more.

matplotlib is imported when the first figure is drawn.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torc.benchmark.measures import COST, DROP_FREE, SUCCESS
from torc.benchmark.paper import paper_success
from torc.benchmark.report.content import CATEGORIES
from torc.benchmark.report.drawing import (
    GREY,
    INK,
    boxes,
    colour,
    heat_map,
    legend,
    load_matplotlib,
    name_planners,
    new_figure,
    paper_marks,
    whisker,
)
from torc.benchmark.rows import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WORDS = {
    "success": (
        "Success (the paper's figure 9, left)",
        "Share of trials in which the target was retrieved. Coloured: with no drop; grey, hatched: with drops. Lines: "
        "95 % intervals. Diamonds: the paper's values, upper one for all successes, lower one for those with no drop.",
    ),
    "picks": (
        "Picks required (the paper's figure 9, right)",
        "Picks of every completed trial, failed attempts included. Box: quartiles and median. Diamonds: the paper's "
        "medians.",
    ),
    "drops": (
        "Objects dropped (the paper's figure 10, left)",
        "Objects other than the target that fell off the table, of every completed trial. Diamonds: the paper's "
        "medians.",
    ),
    "decision_time": (
        "Decision time (the paper's figure 10, right)",
        "Wall time of every decision on a logarithmic scale (0.1 ms is the least that is shown). Diamonds: the paper's "
        "medians, on other machines.",
    ),
    "categories": (
        "Structured against unstructured scenes",
        "Left: share of trials with the target retrieved. Right: picks to retrieval. Lines: 95 % intervals.",
    ),
    "problems": (
        "Every problem",
        "A row per problem. Left: share of trials with the target retrieved (in brackets the paper's, for its own "
        "problems). Right: mean picks to retrieval. Yellow is good, dark blue is bad.",
    ),
}
"""Title and text of each figure."""


@dataclass(frozen=True)
class Picture:
    """A figure, drawn.

    Attributes:
        name: of its files.
        title: what it shows.
        text: the same in words, for those who do not see it.
        svg: the drawing.
        png: the drawing as pixels.
    """

    name: str
    title: str
    text: str
    svg: bytes
    png: bytes

    def save(self, directory: Path) -> None:
        """NAME.svg and NAME.png."""
        (directory / f"{self.name}.svg").write_bytes(self.svg)
        (directory / f"{self.name}.png").write_bytes(self.png)


def draw_all(table: Table, planners: Sequence[str]) -> list[Picture]:
    """All figures, planners in the given order; those without a completed trial are left out.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    shown = [p for p in planners if table.completed(p)]
    if not shown:
        return []
    draws = {
        "success": _success,
        "picks": _picks,
        "drops": _drops,
        "decision_time": _decision_time,
        "categories": _categories,
        "problems": _problems,
    }
    return [Picture(name, *_WORDS[name], *_drawn(name, draw, table, shown)) for name, draw in draws.items()]


def _drawn(
    name: str, draw: Callable[[Table, list[str]], Figure], table: Table, planners: list[str]
) -> tuple[bytes, bytes]:
    matplotlib = load_matplotlib()
    settings = {
        "svg.fonttype": "none",
        "svg.hashsalt": name,
        "font.family": "sans-serif",
        "font.size": 10,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "hatch.linewidth": 0.6,
    }
    with matplotlib.rc_context(settings):
        figure = draw(table, planners)
        figure.tight_layout()
        svg, png = io.BytesIO(), io.BytesIO()
        figure.savefig(svg, format="svg", metadata={"Date": None})
        figure.savefig(png, format="png", dpi=150)
    return svg.getvalue(), png.getvalue()


def _success(table: Table, planners: list[str]) -> Figure:
    figure, (axes,) = new_figure(max(5.4, 1.8 + 0.85 * len(planners)), 3.8)
    for i, planner in enumerate(planners):
        done = table.completed(planner)
        success, clean = SUCCESS.of(done), DROP_FREE.of(done)
        axes.bar(i, clean.value, 0.62, color=colour(i), label="with no drop" if i == 0 else None)
        axes.bar(
            i,
            success.value - clean.value,
            0.62,
            clean.value,
            color=GREY,
            hatch="///",
            edgecolor="white",
            label="with drops" if i == 0 else None,
        )
        whisker(axes, i, success)
        paper_marks(axes, i, planner, lambda m: [m.success, m.drop_free], first=i == 0)
    axes.set_ylim(0, 1.04)
    axes.set_ylabel("share of trials")
    name_planners(axes, planners)
    legend(axes)
    return figure


def _picks(table: Table, planners: list[str]) -> Figure:
    return boxes(table, planners, lambda r: [r.picks], lambda m: [m.picks], "picks per trial")


def _drops(table: Table, planners: list[str]) -> Figure:
    return boxes(table, planners, lambda r: [r.drops], lambda m: [m.drops], "objects dropped per trial")


def _decision_time(table: Table, planners: list[str]) -> Figure:
    figure = boxes(
        table,
        planners,
        lambda r: [max(p.decision_s, 1e-4) for p in r.picked],
        lambda m: [] if m.decision_s is None else [m.decision_s],
        "seconds per decision",
    )
    figure.axes[0].set_yscale("log")
    return figure


def _categories(table: Table, planners: list[str]) -> Figure:
    figure, all_axes = new_figure(max(8.4, 3.0 + 1.7 * len(planners)), 3.8, 2)
    for axes, measure in zip(all_axes, (SUCCESS, COST)):
        for k, (category, marker) in enumerate(zip(CATEGORIES, ("s", "o"))):
            for i, planner in enumerate(planners):
                found = measure.of(table.completed(planner, category))
                if found.count:
                    x = i + 0.24 * k - 0.12
                    whisker(axes, x, found)
                    axes.scatter(x, found.value, 52, marker=marker, color=colour(i), edgecolor=INK, zorder=4)
            axes.scatter([], [], 52, marker=marker, color="white", edgecolor=INK, label=category)
        axes.set_ylabel("share retrieved" if measure is SUCCESS else measure.name)
        name_planners(axes, planners)
        legend(axes)
    all_axes[0].set_ylim(0, 1.04)
    return figure


def _problems(table: Table, planners: list[str]) -> Figure:
    problems = table.problems
    figure, all_axes = new_figure(max(7.0, 3.4 + 1.5 * len(planners)), 1.8 + 0.27 * len(problems), 2)
    success, cost = (np.full((len(problems), len(planners)), np.nan) for _ in range(2))
    words = [["" for _ in planners] for _ in problems]
    for j, planner in enumerate(planners):
        done = table.completed(planner)
        for i, problem in enumerate(problems):
            rows = [r for r in done if r.problem == problem]
            if rows:
                success[i, j] = np.mean([r.retrieved for r in rows])
                cost[i, j] = np.mean([r.cost for r in rows])
                published = paper_success(problem, planner)
                words[i][j] = "" if published is None else f" ({published:.2f})"
    budget = max(r.max_picks for r in table.rows)
    heat_map(all_axes[0], success, planners, "share retrieved", "cividis", (0, 1), 2, words)
    heat_map(all_axes[1], cost, planners, "picks to retrieval", "cividis_r", (1, budget), 1)
    all_axes[0].set_yticks(range(len(problems)), problems)
    all_axes[1].set_yticks([])
    return figure
