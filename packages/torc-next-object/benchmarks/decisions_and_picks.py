"""Does the regret of single decisions tell who needs few picks? Rank correlation over deciders measured both ways.

torc bench --problems torc40 --planners vlm-grasps:simulated:0.5,... --repeats 1 --out runs/vlms
torc bench --problems torc40 --planners packages/torc-next-object/benchmarks/decisions_and_picks.py:First,... \\
  --repeats 1 --out runs/rules
python packages/torc-next-object/benchmarks/decisions_and_picks.py next_object results/torc-hard runs/vlms runs/rules
"""

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from scipy.stats import spearmanr

from torc.benchmark.reading import read_tables
from torc.benchmark.rows import TrialRow
from torc.records import Decision, PlanningContext
from torc_next_object.data.opening import open_rows
from torc_next_object.making.baselines import largest, nearest
from torc_next_object.scoring import score_answer

_RESAMPLES = 2000


class First:
    """Takes the object with the lowest number."""

    name = "first"

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The same again and again where it cannot be picked: that is what the rule says."""
        return Decision(min(context.scene.ids), "the first")


class Largest:
    """Takes what covers the most pixels of what can be grasped."""

    name = "largest"

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """None where nothing can be grasped."""
        return Decision(largest(context), "the largest")


class Nearest:
    """Takes what is nearest to the camera of what can be grasped."""

    name = "nearest"

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """None where nothing can be grasped."""
        return Decision(nearest(context), "the nearest")


@dataclass(frozen=True)
class Args:
    """Compare deciders on single decisions and in whole trials."""

    data: tyro.conf.Positional[str]
    """The data set; its decisions of torc40 are those that count."""
    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Trials on torc40, or published results."""


def single(data: str) -> dict[str, dict[str, np.ndarray]]:
    """Per decider and scene: the sums of picks lost, and of what random choices lose."""
    sums: dict[str, dict[str, np.ndarray]] = defaultdict(lambda: defaultdict(lambda: np.zeros(2)))
    for row in open_rows(data, "test"):
        if row["source"] != "torc40":
            continue
        for name, number in json.loads(row["baselines"]).items():
            scored = score_answer(row, number)
            sums[name][scored.scene] += (scored.counts * scored.lost, scored.counts * scored.spread)
    return sums


def whole(rows: Iterable[TrialRow]) -> dict[str, dict[str, list[float]]]:
    """Per decider and problem: picks, all that there are where the target was not retrieved."""
    found: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        if row.completed:
            found[_decider(row.planner)][row.problem].append(row.cost)
    return found


def _decider(planner: str) -> str:
    """By the name that the data set has for it."""
    asked, _, model = planner.partition("[")
    return model.removesuffix("]").replace(" ", "-") if model else asked.rpartition(":")[2].lower()


def correlation(
    regrets: Mapping[str, Mapping[str, np.ndarray]], picks: Mapping[str, Mapping[str, Sequence[float]]]
) -> tuple[float, float, float, dict[str, tuple[float, float]]]:
    """Spearman's rank correlation with its interval (95 %, scenes and problems drawn anew), and both measures by
    decider.
    """
    names = sorted(set(regrets) & set(picks))
    scenes = sorted({s for name in names for s in regrets[name]})
    problems = sorted(set.intersection(*(set(picks[name]) for name in names)))
    lost = np.array([[regrets[name].get(s, np.zeros(2)) for s in scenes] for name in names])
    taken = np.array([[np.mean(picks[name][p]) for p in problems] for name in names])

    def both(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sums = lost[:, a].sum(axis=1)
        return sums[:, 0] / sums[:, 1], taken[:, b].mean(axis=1)

    rng = np.random.default_rng(0)
    again = []
    for _ in range(_RESAMPLES):
        a, b = rng.integers(len(scenes), size=len(scenes)), rng.integers(len(problems), size=len(problems))
        again.append(spearmanr(*both(a, b)).statistic)
    regret, mean = both(np.arange(len(scenes)), np.arange(len(problems)))
    low, high = np.quantile(again, (0.025, 0.975))
    table = {name: (float(r), float(p)) for name, r, p in zip(names, regret, mean)}
    return float(spearmanr(regret, mean).statistic), float(low), float(high), table


def main() -> None:
    """Print both measures and the correlation."""
    args = tyro.cli(Args)
    rank, low, high, table = correlation(single(args.data), whole(read_tables(args.runs).rows))
    print("| decider | regret, single decisions | picks, whole trials |\n|---|---|---|")
    for name, (regret, picks) in sorted(table.items(), key=lambda kv: kv[1]):
        print(f"| `{name}` | {regret:.2f} | {picks:.2f} |")
    print(f"\nRank correlation over {len(table)} deciders: {rank:.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
