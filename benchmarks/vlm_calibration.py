"""Calibrates the simulated VLM's profile `paper` to the picks that the paper's VLM lost.

    torc problems generate --count 20 --seed 730000 --out runs/calibration
    torc problems generate --structured --count 4 --seed 740000 --hidden hidden --out runs/calibration_hidden
    python -m benchmarks.vlm_calibration --problems runs/calibration,runs/calibration_hidden --workers 2

RANDOM plays every problem; each moment at which it decides is a situation in which a VLM might be asked. The paper's
VLM lost .447 of VLM-SELECT's picks, and .085 of VLM+GRASPS', because three answers named nothing graspable. A planner
whose answers name something graspable with probability p loses q = (1-p)^3 of its picks in a situation, and meets the
same situation again after a lost pick: q / (1 - q) lost picks for each one that is not. Four numbers of the profile
follow:

- front and below: how often the geometric rules of DG-SELECT are right on these relations; the paper could not tell
  VLM-FIXES-DG from DG-SELECT;
- blocked: how often it notices that something cannot be grasped, from VLM-SELECT's share of lost picks;
- heeds_facts: how often it goes by what it is told on grasps, from VLM+GRASPS'.

Situations already in --out are not gathered again. The problems are none of the shipped ones.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import tyro

from benchmarks.processes import run_jobs

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
    seeds: int = 1
    """Seeds 0..N-1 of RANDOM's trials."""
    repeats: int = 20
    """Answers per situation."""
    workers: int = 2
    """Processes."""


def gather(problem: str, seed: int, path: Path) -> str:
    """Play a trial of RANDOM, and keep the situations in which it decides."""
    from torc.episode.privileged import Simulation
    from torc.specs.trial import TrialSpec
    from torc.task_planning.random_choice import RandomPlanner
    from torc.task_planning.relations import find_relations
    from torc.trials.trial import Situations, run_trial
    from torc.vlm.question_facts import grasp_facts

    class Watcher(RandomPlanner):
        """RANDOM that writes down what is so."""

        def __init__(self) -> None:
            self.situations, self.rows = Situations(), []

        def attach(self, simulation: Simulation) -> None:
            self.situations.attach(simulation)

        def decide(self, context, rng):
            if context.report.graspable_ids:
                row = {"facts": grasp_facts(context), **plain(self.situations.situation())}
                found = [(r.source, r.kind.value, r.target) for r in find_relations(context.scene)]
                self.rows.append({**row, "by_geometry": found})
            return super().decide(context, rng)

    watcher = Watcher()
    spec = TrialSpec.of(problem, "random", seed)
    run_trial(
        spec, path.with_suffix(""), planner=watcher, listeners=[watcher.situations], say=lambda text: None
    )
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
    from torc.vlm.asker import fill_prompt
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


def geometric_accuracy(rows: Sequence[dict]) -> tuple[float, float]:
    """How often the geometric rules are right on who stands in front, and on who lies on whom, of pairs that meet."""
    front, below = [], []
    for row in rows:
        truth = situation_from(row)
        claimed = {(kind, s, t) for s, kind, t in row["by_geometry"]}
        for pair in truth.near:
            both = (pair, pair[::-1])
            below.append(all((("below", s, t) in claimed) == ((t, s) in truth.lies_on) for s, t in both))
            # By the rules of the graph, of two objects that lie on each other none is behind the other.
            if not {*both} & truth.lies_on:
                front += [(("behind", s, t) in claimed) == ((t, s) in truth.hides) for s, t in both]
    return float(np.mean(front)), float(np.mean(below))


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
    from torc.problems.sets import select_problems
    from torc.vlm.simulated.profiles import Profile

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

    front, below = (round(share, 2) for share in geometric_accuracy(rows))
    plain_profile = Profile("paper", 1.0, front, below, 1.0, 0.0, 0.0, _SLIPS, _SLIPS)

    def lost(prompt: str, profile: Profile) -> float:
        p = shares(rows, profile, prompt, args.repeats)
        share = lost_share(p)
        print(f"{prompt}: {profile}: names something graspable {p.mean():.3f}, lost {share:.3f}", flush=True)
        return share

    blocked = fitted(LOST_BY_SELECT, lambda b: lost("vlm-select-1", replace(plain_profile, blocked=b)))
    noticing = replace(plain_profile, blocked=blocked)
    heeds = fitted(LOST_BY_GRASPS, lambda h: lost("vlm-grasps-1", replace(noticing, heeds_facts=h)))
    print(asdict(replace(noticing, heeds_facts=heeds)))


if __name__ == "__main__":
    main()
