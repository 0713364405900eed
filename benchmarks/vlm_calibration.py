"""Calibrates the simulated VLM's profile `paper` to the picks that the paper's VLM lost.

    torc problems generate --count 20 --seed 730000 --out runs/calibration_problems
    python benchmarks/vlm_calibration.py --problems runs/calibration_problems --out runs/vlm_calibration --workers 2

RANDOM plays every problem; each moment at which it decides is a situation in which a VLM might be asked. The paper's
VLM lost .447 of VLM-SELECT's picks, and .085 of VLM+GRASPS', because three answers named nothing graspable. A planner
whose answers name something graspable with probability p loses q = (1-p)^3 of its picks in a situation, and meets the
same situation again after a lost pick: q / (1 - q) lost picks for each one that is not. Two numbers of the profile
follow: one accuracy for all that it makes out in the picture, from VLM-SELECT's share, then how often it heeds what it
is told on grasps, from VLM+GRASPS'. Situations already in --out are not gathered again. The problems are none of the
shipped ones.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import tyro

from processes import run_jobs

LOST_BY_SELECT, LOST_BY_GRASPS = 1557 / 3480, 194 / 2288
_SLIPS = 0.02
_FURTHEST_LOST = 15.0


@dataclass(frozen=True)
class Args:
    """Gather situations, then fit."""

    problems: str
    """A set, problems or a directory of them, with commas between; not what planners are compared on."""
    out: Path = Path("runs/vlm_calibration")
    """Directory of the situations."""
    seeds: int = 2
    """Seeds 0..N-1 of RANDOM's trials."""
    repeats: int = 40
    """Answers per situation."""
    workers: int = 2
    """Processes."""


def gather(problem: str, seed: int, path: Path) -> str:
    """Play a trial of RANDOM, and keep the situations in which it decides."""
    from torc.episode.privileged import Simulation
    from torc.episode.trial import TrialSpec, run_trial
    from torc.episode.witness import Witness
    from torc.task_planning.random_choice import RandomPlanner
    from torc.vlm.select import grasp_facts

    class Watcher(RandomPlanner):
        """RANDOM that writes down what is so."""

        def __init__(self) -> None:
            self.witness, self.rows = Witness(), []

        def attach(self, simulation: Simulation) -> None:
            self.witness.attach(simulation)

        def decide(self, context, rng):
            if context.report.graspable_ids:
                self.rows.append({"facts": grasp_facts(context), **plain(self.witness.situation())})
            return super().decide(context, rng)

    watcher = Watcher()
    spec = TrialSpec(problem, "random", seed)
    run_trial(spec, path.with_suffix(""), planner=watcher, listeners=[watcher.witness], say=lambda text: None)
    path.write_text(json.dumps(watcher.rows))
    return f"{path.stem}: {len(watcher.rows)} situations"


def plain(situation) -> dict:
    """A situation as JSON-compatible data."""
    return {
        "in_sight": sorted(situation.in_sight.items()),
        "graspable": sorted(situation.graspable),
        "lies_on": sorted(situation.lies_on),
        "hides": sorted((*pair, n) for pair, n in situation.hides.items()),
        "blocks": sorted(situation.blocks),
        "near": sorted(situation.near),
    }


def situation_from(row: dict):
    """The situation that `plain` wrote."""
    from torc.vlm.simulated.situation import Situation

    pairs = {name: frozenset(map(tuple, row[name])) for name in ("lies_on", "blocks", "near")}
    hides = {(front, back): n for front, back, n in row["hides"]}
    return Situation(dict(row["in_sight"]), frozenset(row["graspable"]), hides=hides, **pairs)


def shares(rows: Sequence[dict], profile, prompt: str, repeats: int) -> np.ndarray:
    """Per situation the share of answers that name something graspable."""
    from torc.vlm.answers import PLAN_SCHEMA, read_first_pick
    from torc.vlm.prompt_files import fill_prompt
    from torc.vlm.protocol import Question
    from torc.vlm.simulated.client import SimulatedVlm

    found = []
    for i, row in enumerate(rows):
        situation = situation_from(row)
        client = SimulatedVlm(profile, lambda truth=situation: truth)
        text = fill_prompt(prompt, target=0, target_state="", facts="\n".join(row["facts"]))
        replies = [client.ask(Question(text, (), PLAN_SCHEMA, repeats * i + r)) for r in range(repeats)]
        named = [read_first_pick(reply, situation.in_sight) for reply in replies]
        found.append(np.mean([chosen in situation.graspable for chosen in named]))
    return np.array(found)


def lost_share(p: np.ndarray) -> float:
    """Share of lost picks, where each situation is met until a pick is not lost, or the budget is spent."""
    q = (1.0 - p) ** 3
    lost = np.minimum(q / np.maximum(1.0 - q, 1e-9), _FURTHEST_LOST)
    return float(lost.sum() / (lost + 1.0).sum())


def fitted(target: float, lost: Callable[[float], float], steps: int = 7) -> float:
    """Where a falling function of a number from 0 to 1 has that value, by halving."""
    low, high = 0.0, 1.0
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lost(middle) > target else (low, middle)
    return round(0.5 * (low + high), 2)


def main() -> None:
    """Gather, fit and print."""
    from torc.scenes.problem_sets import select_problems
    from torc.vlm.simulated.profiles import profile_of_accuracy

    args = tyro.cli(Args)
    args.out.mkdir(parents=True, exist_ok=True)
    files = {
        (problem, seed): args.out / f"{Path(problem).stem}-{seed}.json"
        for problem in select_problems(args.problems)
        for seed in range(args.seeds)
    }
    missing = [(*key, path) for key, path in files.items() if not path.exists()]
    run_jobs(gather, missing, args.workers)
    rows = [row for path in files.values() for row in json.loads(path.read_text())]
    graspable = np.mean([len(row["graspable"]) / len(row["in_sight"]) for row in rows])
    print(f"{len(rows)} situations; {graspable:.2f} of the objects in sight are graspable")

    def profile(accuracy: float, heeds: float = 0.0):
        made = profile_of_accuracy(accuracy, "fitted")
        return replace(made, heeds_facts=heeds, made_up=_SLIPS, malformed=_SLIPS)

    def lost(prompt: str, accuracy: float, heeds: float = 0.0) -> float:
        p = shares(rows, profile(accuracy, heeds), prompt, args.repeats)
        print(
            f"{prompt}: accuracy {accuracy:.3f}, heeds {heeds:.3f}: names something graspable {p.mean():.3f}, "
            f"lost {lost_share(p):.3f}",
            flush=True,
        )
        return lost_share(p)

    accuracy = fitted(LOST_BY_SELECT, lambda a: lost("vlm-select-1", a))
    heeds = fitted(LOST_BY_GRASPS, lambda h: lost("vlm-grasps-1", accuracy, h))
    print(asdict(profile(accuracy, heeds)))


if __name__ == "__main__":
    main()
