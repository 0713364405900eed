"""The figure of `vlm_break_even.py`: what a planner attains over the accuracy of its simulated VLM."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torc.benchmark.intervals import Estimate
from torc.errors import MissingDependencyError, extra_remedy

# Okabe and Ito's colours, which colour-blind people tell apart; shapes and dashes tell the same again.
_STYLES = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"))
_LEVELS = (("#000000", "-"), ("#7f7f7f", "--"), ("#E69F00", ":"), ("#56B4E9", "-."))
_STEP = 0.1
_APART = 0.012
"""Planners are drawn beside each other, so that intervals do not cover each other."""


@dataclass(frozen=True)
class Line:
    """One planner.

    Attributes:
        name: of the planner.
        points: (accuracy, level).
        profiles: (name of a profile, level); drawn to the left of the accuracies.
    """

    name: str
    points: Sequence[tuple[float, Estimate]]
    profiles: Sequence[tuple[str, Estimate]] = ()


@dataclass(frozen=True)
class Panel:
    """One quantity.

    Attributes:
        title: what is on the y axis.
        lines: planners that ask the VLM.
        levels: planners that do not -> level.
        top: upper end of the y axis; None to let the data decide.
    """

    title: str
    lines: Sequence[Line]
    levels: Mapping[str, Estimate]
    top: float | None = None


def draw(panels: Sequence[Panel], paths: Sequence[Path], note: str = "") -> None:
    """Draw the panels side by side into files; the ending says in which form. `note` stands in the title.

    Raises MissingDependencyError without matplotlib.
    """
    try:
        import matplotlib
    except ImportError as error:
        raise MissingDependencyError("matplotlib", extra_remedy("train")) from error
    matplotlib.use("agg")
    # The same file for the same numbers: no random ids, no date.
    matplotlib.rcParams.update({"svg.hashsalt": "torc", "font.size": 9})
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(panels), figsize=(4.2 * len(panels), 4.0), squeeze=False)
    for panel, axis in zip(panels, axes[0], strict=True):
        _draw_panel(panel, axis)
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=len(labels), frameon=False)
    title = f"Simulated VLM: no model was asked. 95 % intervals over problems. {note}"
    figure.suptitle(title.strip(), fontsize=10)
    figure.tight_layout(rect=(0, 0.07, 1, 0.97))
    for path in paths:
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)
    plt.close(figure)


def _draw_panel(panel: Panel, axis: Any) -> None:
    for (name, level), (color, dashes) in zip(panel.levels.items(), _LEVELS):
        axis.axhline(level.value, color=color, linestyle=dashes, linewidth=1.2, label=name)
        axis.axhspan(level.low, level.high, color=color, alpha=0.08, linewidth=0)
    accuracies = sorted({x for line in panel.lines for x, _ in line.points})
    profiles = list(dict.fromkeys(name for line in panel.lines for name, _ in line.profiles))
    start = accuracies[0] if accuracies else 0.5
    places = {name: start - _STEP * (len(profiles) - i) for i, name in enumerate(profiles)}
    for i, line in enumerate(panel.lines):
        color, marker = _STYLES[i % len(_STYLES)]
        shift = _APART * (i - (len(panel.lines) - 1) / 2)
        _errorbar(axis, [(x + shift, b) for x, b in line.points], color, marker, "-", line.name)
        alone = [(places[name] + shift, b) for name, b in line.profiles]
        _errorbar(axis, alone, color, marker, "none", None)
    if profiles and accuracies:
        axis.axvline(start - _STEP / 2, color="#cccccc", linewidth=0.8)
    axis.set_xticks([*places.values(), *accuracies], [*places, *(f"{x:g}" for x in accuracies)])
    axis.set_xlabel("accuracy of the simulated VLM")
    axis.set_title(panel.title, fontsize=10)
    axis.set_ylim(0.0, panel.top)
    axis.spines[["top", "right"]].set_visible(False)


def _errorbar(
    axis: Any, points: Sequence[tuple[float, Estimate]], color: str, marker: str, line: str, label: str | None
) -> None:
    if points:
        values = [b.value for _, b in points]
        below = [b.value - b.low for _, b in points]
        above = [b.high - b.value for _, b in points]
        axis.errorbar(
            [x for x, _ in points],
            values,
            yerr=[below, above],
            color=color,
            marker=marker,
            linestyle=line,
            markersize=5,
            linewidth=1.4,
            capsize=2,
            label=label,
        )
