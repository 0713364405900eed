"""Each stage of a pick against its budget, and against what the paper's system took.

    python -m benchmarks.stages [--seeds 1] [--picks 3] [--perception embedded --depth sgbm]

Plays the first picks of every problem of torc40 with DG-SELECT, kernels warm, one process. The paper's times are its
authors': grasp planning 16-20 s, motion planning 4-5 s, DG-SELECT 27 s (5 s in a later rerun), an episode
380-630 s, all on a GPU workstation.
"""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import tyro

from torc.episode.events import Decided, Event, Executed, Looked, Planned, Started
from torc.episode.loop import run_episode
from torc.episode.simulated import episode_in, simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.pipeline.building import build_system
from torc.pipeline.planners import make_planner
from torc.problems.problem import load_problem
from torc.problems.sets import problem_names
from torc.specs.conditions import Conditions


@dataclass(frozen=True)
class Row:
    """A line of the table: the budget's median and 95th percentile, and the paper's time; seconds."""

    median_s: float
    p95_s: float
    paper_s: float = float("nan")


BUDGETS = {
    "perceive + occlusion update": Row(0.060, 0.100),
    "grasps, IK, validity, blocking": Row(0.300, 0.600, 18.0),
    "DG-SELECT decision": Row(0.010, 0.050, 27.3),
    "image to decision": Row(0.500, float("nan"), 45.0),
    "motion plans of one pick": Row(0.150, 0.500, 4.5),
    "simulated pick": Row(1.5, 4.0),
}
OWN_EYES = BUDGETS | {
    "perceive + occlusion update": Row(0.150, float("nan")),
    "image to decision": Row(0.600, float("nan"), 45.0),
}
"""For perceptions that find the objects themselves."""


@dataclass(frozen=True)
class Args:
    """Time the stages."""

    seeds: int = 1
    """Seeds per problem."""
    picks: int = 3
    """Picks per episode."""
    every: int = 1
    """Every so manieth problem."""
    conditions: tyro.conf.OmitArgPrefixes[Conditions] = field(default_factory=Conditions)


class Stopwatch:
    """Collects the seconds of each stage from the events."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    def __call__(self, event: Event) -> None:
        """Note one event's times."""
        match event:
            case Looked():
                s = event.look.seconds
                self.seconds["perceive + occlusion update"].append(s["perceive"] + s["occlusion"])
                grasps = s["collision world"] + s["grasps"] + s["validity"]
                self.seconds["grasps, IK, validity, blocking"].append(grasps)
                self._look_s = sum(s.values())
            case Decided():
                self.seconds["DG-SELECT decision"].append(event.seconds)
                self.seconds["image to decision"].append(self._look_s + event.seconds)
            case Planned():
                self.seconds["motion plans of one pick"].append(event.seconds)
            case Executed() if event.seconds > 0:
                self.seconds["simulated pick"].append(event.seconds)
            case _:
                pass


def main() -> None:
    """Run and print the table."""
    args = tyro.cli(Args)
    system, planner = build_system(args.conditions), make_planner("dg-select")
    watch, warm = Stopwatch(), False
    for seed in range(args.seeds):
        for problem in map(load_problem, problem_names("torc40")[:: args.every]):
            with simulated_robot(system, problem) as simulated:
                simulated.take_over()
                episode = episode_in(simulated, system, EpisodeConfig(args.picks, seed), [watch])
                if not warm:
                    episode.rehearse(planner)
                    warm = True
                started = Started(problem.name, planner.name, seed, problem.description, args.picks)
                run_episode(episode, planner, started)
    print("| step | samples | median, s | p95, s | budget, s | paper, s | paper / ours |")
    print("|---|---|---|---|---|---|---|")
    budgets = BUDGETS if args.conditions.perception == Conditions().perception else OWN_EYES
    for name, budget in budgets.items():
        median, p95 = np.percentile(watch.seconds[name], [50, 95])
        limits = f"{budget.median_s:g}" + ("" if np.isnan(budget.p95_s) else f" / {budget.p95_s:g}")
        paper = (
            ("-", "-")
            if np.isnan(budget.paper_s)
            else (f"{budget.paper_s:g}", f"{budget.paper_s / median:.0f} x")
        )
        count = len(watch.seconds[name])
        print(f"| {name} | {count} | {median:.3f} | {p95:.3f} | {limits} | {paper[0]} | {paper[1]} |")


if __name__ == "__main__":
    main()
