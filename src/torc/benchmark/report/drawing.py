"""What the figures are drawn with: colours, boxes, whiskers, heat maps, the paper's marks.

Colours are those of M. Okabe and K. Ito, which people of every colour vision can tell apart; hatches and markers say
the same again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from torc.benchmark.intervals import Estimate
from torc.benchmark.paper import PaperMethod, paper_method
from torc.benchmark.rows import Table, TrialRow
from torc.errors import MissingDependencyError, extra_remedy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442", "#666666")
GREY, INK = "#C8C8C8", "#1E1E1E"
_PAPER_MARK: dict[str, Any] = {
    "marker": "D",
    "s": 46,
    "facecolor": "white",
    "edgecolor": INK,
    "linewidth": 1.3,
    "zorder": 5,
}
_MAX_POINTS = 400


def load_matplotlib() -> Any:
    """The library. Raises MissingDependencyError."""
    try:
        import matplotlib
    except ImportError:
        raise MissingDependencyError("matplotlib, which draws the figures,", extra_remedy("report")) from None
    return matplotlib


def new_figure(width: float, height: float, columns: int = 1) -> tuple[Figure, Any]:
    """A figure with axes side by side; inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(1, columns, squeeze=False)[0]


def colour(index: int) -> str:
    """Of a planner, by its place."""
    return COLOURS[index % len(COLOURS)]


def name_planners(axes: Axes, planners: list[str]) -> None:
    """Planners along the x axis."""
    axes.set_xticks(range(len(planners)), [p.replace("[", "\n[") for p in planners], rotation=20, ha="right")
    axes.set_xlim(-0.6, len(planners) - 0.4)


def whisker(axes: Axes, x: float, found: Estimate) -> None:
    """An interval as a line; none where it has no end."""
    if np.isfinite(found.high):
        below, above = max(found.value - found.low, 0.0), max(found.high - found.value, 0.0)
        axes.errorbar(x, found.value, [[below], [above]], color=INK, capsize=4, linewidth=1.3, zorder=3)


def paper_marks(
    axes: Axes, i: int, planner: str, values: Callable[[PaperMethod], list[float]], *, first: bool
) -> None:
    """The paper's values beside a planner's; an entry of the legend with the first."""
    method = paper_method(planner)
    marks = values(method) if method else []
    if marks:
        axes.scatter([i + 0.36] * len(marks), marks, **_PAPER_MARK)
    if first:
        axes.scatter([], [], **_PAPER_MARK, label="the paper")


def legend(axes: Axes) -> None:
    """Above the axes."""
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.16), ncols=3, frameon=False, fontsize=9)


def heat_map(
    axes: Axes,
    values: np.ndarray,
    planners: list[str],
    title: str,
    colours: str,
    limits: tuple[float, float],
    digits: int,
    words: list[list[str]] | None = None,
) -> None:
    """Problems down, planners across, the values written in; `words` follow them."""
    low, high = limits
    axes.imshow(values, cmap=colours, vmin=low, vmax=high, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            good = (value - low) / (high - low) if colours == "cividis" else (high - value) / (high - low)
            ink = "black" if good > 0.5 else "white"
            text = f"{value:.{digits}f}" + (words[i][j] if words else "")
            axes.text(j, i, text, ha="center", va="center", color=ink, fontsize=8)
    axes.set_title(title, fontsize=10)
    axes.spines[:].set_visible(False)
    name_planners(axes, planners)
    axes.set_xlim(-0.5, len(planners) - 0.5)


def boxes(
    table: Table,
    planners: list[str],
    values: Callable[[TrialRow], list[float]],
    papers: Callable[[PaperMethod], list[float]],
    label: str,
) -> Figure:
    """A box, and points, of all values of each planner's completed trials."""
    figure, (axes,) = new_figure(max(5.4, 1.8 + 0.85 * len(planners)), 3.8)
    rng = np.random.default_rng(0)
    for i, planner in enumerate(planners):
        numbers = np.array([v for row in table.completed(planner) for v in values(row)], dtype=float)
        if len(numbers):
            axes.boxplot(
                numbers,
                positions=[i],
                widths=0.5,
                showfliers=False,
                patch_artist=True,
                boxprops={"facecolor": colour(i), "alpha": 0.35, "edgecolor": INK},
                medianprops={"color": INK, "linewidth": 2.2},
            )
            points = (
                numbers if len(numbers) <= _MAX_POINTS else rng.choice(numbers, _MAX_POINTS, replace=False)
            )
            axes.scatter(
                i + rng.uniform(-0.2, 0.2, len(points)), points, 7, color=colour(i), alpha=0.6, zorder=3
            )
        paper_marks(axes, i, planner, papers, first=i == 0)
    axes.set_ylabel(label)
    name_planners(axes, planners)
    legend(axes)
    return figure
