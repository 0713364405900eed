"""Benchmarks without robots: trials that take no time and end as their id tells.

python -m tests.helpers.fake_bench DIR     # plays 24 of them with two processes, going on where it was
... DIR --ray ADDRESS                     # the same on a Ray cluster
"""

import hashlib
import json
import os
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from torc.benchmark.local_pool import Backend, Ending, Failure, FailureKind, LocalPool, PoolConfig, Task, Work
from torc.benchmark.playing import Order, run_missing
from torc.benchmark.ray_pool import ray_pool
from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.benchmark.spec import Around, BenchPlanner, BenchProblem, BenchSpec, make_spec
from torc.benchmark.store import TRIAL, Store
from torc.io.digests import forget_files
from torc.io.pictures import write_png
from torc.io.results import write_json
from torc.specs.conditions import Conditions
from torc.specs.spec_files import to_plain
from torc.specs.trial import PlannerSpec
from torc.trials.log import RESULT_FORMAT
from torc.trials.versions import versions


class InlineBackend:
    """Carries out tasks in this process, one after another, as if it were a new one; some fail, by task key."""

    def __init__(self, failures: Mapping[str, Failure] | None = None) -> None:
        self.failures = failures or {}

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """An ending per task, in order."""
        forget_files()
        for task in tasks:
            failure = self.failures.get(task.key)
            if failure is not None:
                task.log.parent.mkdir(parents=True, exist_ok=True)
                task.log.write_text(f"what it printed before it {failure.kind}")
                yield Ending(task.key, failure)
                continue
            try:
                yield Ending(task.key, work(task.argument))
            except RuntimeError as error:
                yield Ending(task.key, Failure(FailureKind.RAISED, str(error)))


def fake_spec(
    planners: Iterable[str] = ("random", "dg-select"),
    problems: int = 4,
    repeats: int = 3,
    max_picks: int = 15,
) -> BenchSpec:
    """A benchmark of made-up problems, half of them structured. Planners need not exist."""
    made = [
        BenchProblem(f"{kind}-{i:02d}", kind, f"digest {i}", shipped=True)
        for i in range(1, problems // 2 + 1)
        for kind in ("structured", "unstructured")
    ]
    chosen = [BenchPlanner(PlannerSpec(name)) for name in planners]
    return make_spec(made, chosen, range(repeats), Around(Conditions(max_picks=max_picks)), "0.0")


def play_quickly(order: Order) -> None:
    """Write a trial that is decided by its id alone."""
    out = order.work / TRIAL
    aside = out.with_name(TRIAL + ".partial")
    (aside / "picks").mkdir(parents=True)
    write_json(aside / "spec.json", to_plain(order.trial.spec(order.problem), {}))
    result, events = fake_trial(order.trial.id, order.trial.around.conditions.max_picks)
    (aside / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))
    for pick in range(result["picks"]):
        write_png(aside / "picks" / f"{pick:02d}_seen.png", np.full((48, 64, 3), 16 * pick, np.uint8))
    write_json(aside / "result.json", result)
    os.replace(aside, out)


def fake_trial(trial_id: str, max_picks: int = 15) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """result.json and the lines of events.jsonl of a trial."""
    rng = np.random.default_rng(int(hashlib.sha256(trial_id.encode()).hexdigest()[:12], 16))
    picks, retrieved = int(rng.integers(1, max_picks)), bool(rng.random() < 0.8)
    outcomes = ["removed"] * (picks - 1) + ["retrieved" if retrieved else "missed"]
    events: list[dict[str, Any]] = []
    for i, outcome in enumerate(outcomes):
        dropped = [7] if rng.random() < 0.1 else []
        held, picked = outcome != "missed", 0 if i == picks - 1 else i + 1
        looked = {"target_visible": picked == 0, "objects": [], "graspable": []}
        decided = {"object_id": picked, "reason": "", "seconds": float(rng.lognormal(-4, 1))}
        executed = {"result": outcome, "object_id": picked, "held_after_lift": held, "dropped": dropped}
        detail = "" if held else "nothing between the fingers"
        events += [
            {"event": "looked", "pick": i, **looked, "seconds": {"perceive": 0.1, "grasps": 0.2}},
            {"event": "decided", "pick": i, **decided},
            {"event": "planned", "pick": i, "seconds": 0.1},
            {"event": "executed", "pick": i, **executed, "detail": detail, "duration_s": 7.0},
        ]
    drops = sum(len(e["dropped"]) for e in events if e["event"] == "executed")
    result = {
        "format": RESULT_FORMAT,
        "status": "completed",
        "retrieved": retrieved,
        "held_target": retrieved,
        "participant": True,
        "end": "retrieved" if retrieved else "target lost",
        "picks": picks,
        "drops": drops,
        "outcomes": outcomes,
        "versions": versions(),
    }
    return result, events


def play_slowly(order: Order, seconds: float = 0.05) -> None:
    """`play_quickly` after a moment in which the runner, or a machine, can be killed."""
    time.sleep(seconds)
    play_quickly(order)


def _own_node() -> str:
    """Id of the Ray node that this process hangs on: it ends with that node."""
    import ray

    return ray.get_runtime_context().get_node_id()


def main(arguments: list[str]) -> None:
    """Play a fake benchmark in a directory, on this machine or a Ray cluster."""
    store, spec, limits = Store(Path(arguments[0])), fake_spec(), PoolConfig(2, memory_bytes=None)
    with store.locked(), ExitStack() as stack:
        store.extend(spec, {})
        backend: Backend = LocalPool(limits)
        work: Work = play_slowly
        if "--ray" in arguments:
            address = arguments[arguments.index("--ray") + 1]
            backend = stack.enter_context(ray_pool(address, replace(limits, workers=0), spec, {}))
            work = partial(play_slowly, seconds=1.0)
            print(_own_node(), flush=True)
        run_missing(store, spec, backend, work=work)


def made_up_table(
    drops: Sequence[str] = (), references: Sequence[str] = (), **picks: Sequence[Sequence[int]]
) -> Table:
    """A table from lists of picks by planner: `made_up_table(a=[[3, 4], [2, 15]])`, a list per problem; 15 fails."""
    rows = []
    for planner, problems in sorted(picks.items()):
        for i, seeds in enumerate(problems):
            for seed, n in enumerate(seeds):
                row = _row(planner, i, seed, n, dropped=planner in drops)
                rows.append(replace(row, participant=planner not in references))
    return Table(Path("x"), tuple(rows))


def _row(planner: str, problem: int, seed: int, picks: int, dropped: bool) -> TrialRow:
    got = picks < 15
    pick = PickRow(0, "retrieved" if got else "missed", 0, 1, 0.01, 0.3, 0.1, 7.0, 0, got, None, "")
    facts = {"retrieved": got, "held_target": got, "end": "retrieved" if got else "budget spent"}
    facts |= {"picks": picks, "drops": int(dropped), "picked": (pick,)}
    place = "", Path(f"x/{planner}{problem}{seed}"), f"p{problem:02d}"
    category = "structured" if problem % 2 else "unstructured"
    return TrialRow(*place, category, planner, seed, "completed", **facts)


if __name__ == "__main__":
    # Under the name by which other processes find its functions.
    from tests.helpers import fake_bench

    fake_bench.main(sys.argv[1:])
