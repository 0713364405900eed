"""The paper's measurements as data: its figures 9 and 10 in simulation, 11 and 12 on a robot. Ours are shown beside
them.

Source: "Are VLMs Effective Task Planners for Robotic Object Retrieval in Clutter?", figures 9 and 10, and the per-trial
tables that the authors' experiment software wrote: 40 problems, 10 trials each (HUMAN 5), at most 15 picks, VLM Gemini
Robotics-ER 1.5. Their problems, grasp planner and simulation differ from those that come with torc, so the values show
how the methods compare there; they are not a target.

On the robot: the bars of figure 11, left; 3 scenes, 3 trials of each method in each. The paper draws picks, drops and
computing times of these trials, but gives no numbers; RANDOM was not played. Its robot is a Yaskawa sda10f with a
Robotiq 85 gripper and a stereo camera on the torso.
"""

import csv
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

_TITLE = "Are VLMs Effective Task Planners for Robotic Object Retrieval in Clutter?"
CITATION, REAL_CITATION = f"{_TITLE}, figures 9 and 10", f"{_TITLE}, figure 11"
REAL_SCENES, REAL_TRIALS = 3, 9
"""On the robot: scenes, and trials of each method in total."""


@dataclass(frozen=True)
class PaperMethod:
    """A method of the paper: shares of trials with the target retrieved, and with no drop besides (from the chart);
    medians of picks, drops and seconds of a decision, None where the paper gives none.
    """

    success: float
    drop_free: float
    picks: float | None
    drops: float
    decision_s: float | None


METHODS = {
    "random": PaperMethod(0.828, 0.31, 6, 1, 0.4),
    "vlm-select": PaperMethod(0.738, 0.325, 8, 1, 9.3),
    "dg-select": PaperMethod(0.845, 0.45, 4, 0, 27.3),
    "vlm-fixes-dg": PaperMethod(0.88, 0.48, 4, 0.5, 44.8),
    "vlm-grasps": PaperMethod(0.905, 0.385, 4, 1, 18.6),
    "human": PaperMethod(0.975, 0.575, 3, 0, None),
}
"""By the name of torc's planner."""


# Retrieved, and with no drop. At least six of nine trials had no drop, so the median is 0.
_ON_ROBOT = {
    "vlm-select": (8, 6),
    "dg-select": (9, 8),
    "vlm-fixes-dg": (9, 8),
    "vlm-grasps": (9, 9),
    "human": (9, 9),
}
REAL_METHODS = {
    name: PaperMethod(retrieved / REAL_TRIALS, drop_free / REAL_TRIALS, None, 0, None)
    for name, (retrieved, drop_free) in _ON_ROBOT.items()
}
"""The methods on the robot, by the name of torc's planner."""


def paper_method(label: str, real: bool = False) -> PaperMethod | None:
    """Return the paper's method for a planner's label, in simulation or on the robot; None for other planners."""
    return (REAL_METHODS if real else METHODS).get(method_name(label))


def paper_success(problem: str, label: str) -> float | None:
    """Return the paper's success rate on a problem imported from GraspClutter6D; None for other problems."""
    found, name = re.fullmatch(r"gc6d-(\d+)-(obj_\d+_\d+)", problem), method_name(label)
    row = _per_problem().get((int(found[1]), found[2])) if found and name in METHODS else None
    return None if row is None else float(row[f"{name}_success"])


def method_name(label: str) -> str:
    """Return a planner's name from its label, without model or expert."""
    return re.split(r"[\[ ]", label, maxsplit=1)[0]


@cache
def _per_problem() -> dict[tuple[int, str], dict[str, str]]:
    text = (files("torc.benchmark") / "data" / "paper_per_problem.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {(int(row["scene"].rsplit("_", 1)[1]), row["target"]): row for row in rows}
