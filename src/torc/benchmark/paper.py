"""What the paper measured: its figures 9 and 10 as data, beside which ours are shown.

Source: "Are VLMs Effective Task Planners for Robotic Object Retrieval in Clutter?", figures 9 and 10, and the per-trial
tables that the authors' experiment software wrote: 40 problems, 10 trials each (HUMAN 5), at most 15 picks, VLM Gemini
Robotics-ER 1.5. Their problems, grasp planner and simulation differ from those that come with torc, so the values show
how the methods compare there; they are no target.
"""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType

CITATION = "Are VLMs Effective Task Planners for Robotic Object Retrieval in Clutter?, figures 9 and 10"


@dataclass(frozen=True)
class PaperMethod:
    """A method of the paper, under its name there.

    Attributes:
        success: share of trials in which the target was retrieved; `success_95` is its bootstrap interval over the
            40 problems.
        drop_free: share in which it was retrieved and no object was dropped, read from the chart.
        picks_success, picks: median picks of the successful trials, and of all.
        drops, decision_s: medians; None where the paper gives none.
        grasps_held: of the executed grasps.
    """

    name: str
    success: float
    success_95: tuple[float, float]
    drop_free: float
    picks_success: float
    picks: float
    drops: float
    decision_s: float | None
    grasps_held: float


METHODS: Mapping[str, PaperMethod] = MappingProxyType(
    {
        "random": PaperMethod("RANDOM", 0.828, (0.78, 0.87), 0.31, 5, 6, 1, 0.4, 1527 / 2548),
        "vlm-select": PaperMethod("VLM-SELECT", 0.738, (0.67, 0.80), 0.325, 6, 8, 1, 9.3, 1333 / 1883),
        "dg-select": PaperMethod("DG-SELECT", 0.845, (0.80, 0.89), 0.45, 4, 4, 0, 27.3, 1244 / 1812),
        "vlm-fixes-dg": PaperMethod("VLM-FIXES-DG", 0.88, (0.84, 0.92), 0.48, 4, 4, 0.5, 44.8, 1221 / 1790),
        "vlm-grasps": PaperMethod("VLM+GRASPS", 0.905, (0.86, 0.95), 0.385, 4, 4, 1, 18.6, 1374 / 2042),
        "human": PaperMethod("HUMAN", 0.975, (0.96, 1.0), 0.575, 3, 3, 0, None, 639 / 772),
    }
)
"""By the name of torc's planner."""


def paper_method(label: str) -> PaperMethod | None:
    """The paper's method that a planner's label stands for; None for other planners."""
    return METHODS.get(_planner(label))


def paper_success(problem: str, label: str) -> float | None:
    """The paper's success rate on a problem that was imported from GraspClutter6D; None for other problems."""
    found = re.fullmatch(r"gc6d-(\d+)-(obj_\d+_\d+)", problem)
    name = _planner(label)
    if found is None or name not in METHODS:
        return None
    row = _per_problem().get((int(found.group(1)), found.group(2)))
    return None if row is None else float(row[f"{name}_success"])


def _planner(label: str) -> str:
    """A planner's name without model or expert."""
    return re.split(r"[\[ ]", label, maxsplit=1)[0]


@cache
def _per_problem() -> dict[tuple[int, str], dict[str, str]]:
    text = (files("torc.benchmark") / "data" / "paper_per_problem.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {(int(row["scene"].rsplit("_", 1)[1]), row["target"]): row for row in rows}
