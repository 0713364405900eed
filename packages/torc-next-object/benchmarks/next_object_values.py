"""Are the values of torc-next-object what they say? Each is compared with continuations whose grasps and outcomes are
drawn anew: at every try but the first the grasps come from one of ten looks with other seeds, and hold as their scores
say.

python packages/torc-next-object/benchmarks/next_object_values.py --problems torc40 --decisions 200 \\
  --out build/values.jsonl
"""

import json
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import PhysicsError
from torc.oracle.solve import MAX_PICKS, best_hold
from torc.pipeline.better_bet import BetConfig
from torc.pipeline.building import System, build_system
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import TARGET_ID
from torc.specs.conditions import Conditions
from torc_next_object.making.looks import DRAWS, FURTHER_DRAWS, Looks
from torc_next_object.making.pricing import Price, first_tries
from torc_next_object.making.valuing import Gone, Valued, value_choices
from torc_next_object.making.visits import visits

_SEEDS = 10
_SIGNS = 1.96


@dataclass(frozen=True)
class Args:
    """Check values by continuations."""

    problems: str = "torc40"
    """Sets, problems, files or directories of them."""
    decisions: int = 200
    """So many decisions, one choice of each, drawn among what can be picked."""
    per_problem: int = 5
    """Decisions of a problem, at most."""
    continuations: int = 50
    """Of each choice."""
    most_looks: int = 40
    """Of each search for values."""
    out: Path | None = None
    """A line for each decision; what is there already is not done again."""


def continued(
    valued: Valued, choice: int, gone: Gone, looks: Sequence[Looks], left: int, rng: np.random.Generator
) -> float:
    """Picks of one continuation of a choice; a lost target costs all picks that are left. The first of the looks is the
    one that is shown.
    """
    shown, *others = looks
    _, *rest = valued.orders[choice]
    if rng.random() < best_hold(shown.context(gone), choice):
        return 1.0 + followed(rest, gone | {choice}, others, left - 1, rng)
    if choice == TARGET_ID and rng.random() < BetConfig().lost_share:
        return float(left)
    return 1.0 + followed(valued.otherwise, gone, others, left - 1, rng)


def followed(
    order: Sequence[int], gone: Gone, looks: Sequence[Looks], left: int, rng: np.random.Generator
) -> float:
    """Picks of an order, each of which is tried until it succeeds."""
    picks = 0
    for k in order:
        while True:
            picks += 1
            if picks >= left:
                return float(left)
            p = best_hold(looks[int(rng.integers(len(looks)))].context(gone), k)
            if rng.random() < p:
                break
            # Without a grasp, a pick is wasted, but nothing is lost.
            if k == TARGET_ID and p > 0 and rng.random() < BetConfig().lost_share:
                return float(left)
        gone |= {k}
    return float(picks)


def within(value: Price, picks: np.ndarray) -> bool:
    """Whether the mean of the continuations may be a value within its interval."""
    error = _SIGNS * float(picks.std(ddof=1)) / np.sqrt(len(picks))
    return bool(value.low - error <= picks.mean() <= value.high + error)


def main() -> None:
    """Check, a line for each decision, then the share that holds."""
    args = tyro.cli(Args)
    known = args.out.read_text().splitlines() if args.out and args.out.exists() else []
    lines = [json.loads(line) for line in known]
    done = {line["problem"] for line in lines}
    system = build_system(Conditions())
    for name in select_problems(args.problems):
        if len(lines) >= args.decisions:
            break
        if name in done:
            continue
        try:
            found = _checked(name, system, args)
        except PhysicsError as error:
            print(f"{name}: {error}", flush=True)
            continue
        lines += found
        if args.out:
            args.out.parent.mkdir(parents=True, exist_ok=True)
            with open(args.out, "a") as file:
                file.writelines(json.dumps(line) + "\n" for line in found)
        held = sum(line["within"] for line in lines)
        print(f"{name}: {held} of {len(lines)} within ({held / len(lines):.1%})", flush=True)
    differences = np.array([line["mean"] - line["value"] for line in lines])
    print(
        f"Continuations take {differences.mean():+.2f} picks more than the value says (sd {differences.std():.2f})."
    )


def _checked(name: str, system: System, args: Args) -> list[dict[str, Any]]:
    problem, rng = load_problem(name), np.random.default_rng([7, *name.encode()])
    with ExitStack() as stack:
        sandbox = stack.enter_context(open_sandbox(problem, system, EpisodeConfig(MAX_PICKS, 0)))
        others = range(1 + DRAWS + FURTHER_DRAWS, 1 + DRAWS + FURTHER_DRAWS + _SEEDS)
        looks = Looks(sandbox)
        drawn = [looks, *(Looks(sandbox.with_draws(seed)) for seed in others)]
        found = []
        for gone in visits(looks.context, args.per_problem, rng):
            context = looks.context(gone)
            first = first_tries(context)
            valued = value_choices(looks, gone, context.scene.ids, args.most_looks, first)
            known = sorted(k for k, order in valued.orders.items() if order)
            if not known:
                continue
            choice = int(rng.choice(known))
            order, value = valued.orders[choice], valued.values[choice]
            left = MAX_PICKS - len(gone)
            draws = [continued(valued, choice, gone, drawn, left, rng) for _ in range(args.continuations)]
            picks = np.array(draws)
            facts = {"problem": name, "gone": sorted(gone), "order": order, "within": within(value, picks)}
            facts |= {"value": value.mean, "low": value.low, "high": value.high, "mean": float(picks.mean())}
            found.append(facts)
    return found


if __name__ == "__main__":
    main()
