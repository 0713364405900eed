"""`torc bench`: task planners against each other on many problems."""

from __future__ import annotations

import json
import os
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from torc.cli.options import VlmOptions, planners_of
from torc.cli.printing import print_json, split_names, tell
from torc.errors import InputError
from torc.specs.conditions import Conditions

if TYPE_CHECKING:
    from torc.benchmark.local_pool import Backend
    from torc.benchmark.spec import BenchSpec, PlannedTrial
    from torc.benchmark.store import Store
    from torc.problems.problem import Problem
    from torc.trials.log import TrialResult


@dataclass(frozen=True)
class BenchCommand:
    """Play every planner on every problem, several times each, and keep all trials in one directory.

    Run the same command again after Ctrl-C, a crash or a power cut: only missing or errored trials are played. With
    other planners, problems or more repeats, the same directory grows. `torc report DIR` says which planner is best.

    An experiment can be a file: `torc bench experiment.yaml --out DIR`. Options take precedence over its entries:

      problems: validation
      planners: [random, {name: dg-select, settings: {relations.closeness_m: 0.01}}]
      repeats: 3
      sweep: {occlusion.smooth_px: [0, 3]}
      conditions: {noise: true, settings: {grasps.candidates.max_blocked: 40}}

    A planner that crashes, hangs, eats memory or raises costs only its own trials: these are errored, with the cause,
    and never count as failed retrievals. Your own planner, in my_module.py here, against the baselines:

      torc bench --planners random,dg-select,my_module:MyPlanner --out runs/mine

    The same on many machines, with the same results in the same directory (needs the extra `ray`):

      ray start --head --port 6379             # on this machine
      ray start --address HEAD:6379            # on every other, with the same torc
      torc bench --ray auto --out runs/mine    # on this machine again

    A lost machine costs only time. docs/benchmarking.md says which files are sent along.
    With a batch system instead, each task plays a share of its own:

      torc bench --shard 3/20 --out runs/mine/3

    Exit code 0 when all trials were completed, 1 when some errored, 2 on bad arguments, 130 after Ctrl-C.
    """

    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Directory of the benchmark; made, or gone on with if it exists."""
    problems: Annotated[str, tyro.conf.arg(metavar="SET")] = "torc40"
    """Sets, problems, problem files or directories of them, comma-separated (`torc problems list`)."""
    planners: Annotated[str, tyro.conf.arg(metavar="A,B,...")] = "random,dg-select"
    """Task planners, comma-separated, as for `torc run --planner`. One that asks a model may name its own behind it, as
    in vlm-select:gemini:MODEL or vlm-fixes-dg:simulated:0.9, so that several models meet; else --vlm is asked."""
    sweep: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME=A,B,...")] = ()
    """Play everything under each of these conditions, which then stand side by side in the report: a stage, as in
    perception=labels,my_module:Mine, or a setting, as in occlusion.smooth_px=0,3. May be given several times."""
    repeats: int = 10
    """Trials of each planner on each problem, with the seeds 0 to N-1. All planners get the same seeds."""
    first_seed: int = 0
    """Begin with this seed in place of 0: for more trials of what was played elsewhere, or published."""
    workers: int = 0
    """Trials at the same time, on a core each; 0 for as many as there are cores."""
    ray: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Play on a Ray cluster: auto for the one that this machine belongs to, HOST:PORT for that one's head, local to
    start one of this machine's cores."""
    shard: Annotated[str | None, tyro.conf.arg(metavar="I/N")] = None
    """Play only every N-th trial, beginning with the I-th (I from 1 to N): a part for each task of a batch system. Each
    needs an --out of its own; `torc report` takes them all."""
    limit: int | None = None
    """Play at most so many trials now: to try things out; the next call goes on from there."""
    no_pictures: bool = False
    """Keep the log and the result of each trial, but not what the planner saw at each pick: a trial takes a fifth less
    time, and 30 KB in place of 2 MB, but `torc view` cannot show its picks."""
    timeout: float = 1800.0
    """Seconds after which a trial is ended and counts as errored."""
    memory: float = 8.0
    """Bound on the memory of a worker, GiB of address space (Linux); 0 for none."""
    own_planners: Annotated[tuple[tuple[str, dict[str, Any]], ...], tyro.conf.Suppress, tyro.conf.Fixed] = ()
    """Planners of an experiment file that have settings: by name, in place of --planners."""
    dry_run: bool = False
    """Only say what would be played."""
    json: Annotated[bool, tyro.conf.arg(help="Print a JSON summary to stdout.")] = False
    conditions: Conditions = field(default_factory=Conditions)
    vlm: VlmOptions = field(default_factory=VlmOptions)

    @classmethod
    def prepared(cls, arguments: Sequence[str]) -> tuple[dict[str, Any], list[str]]:
        """Return what an experiment file among the arguments sets, and the other arguments. Raises InputError."""
        from torc.cli.experiments import read_experiment

        if not arguments or not arguments[0].endswith((".yaml", ".yml")):
            return {}, list(arguments)
        given = read_experiment(Path(arguments[0]))
        conditions = given["conditions"]
        settings = (f"--{name}={json.dumps(value)}" for name, value in conditions.settings.items())
        return given | {"conditions": replace(conditions, settings={})}, [*settings, *arguments[1:]]

    def run(self) -> int:
        from torc.benchmark.store import Store

        if self.repeats < 1 or self.workers < 0 or (self.limit is not None and self.limit < 1):
            raise InputError("--repeats and --limit must be at least 1, and --workers at least 0.")
        if self.timeout <= 0 or self.memory < 0 or self.first_seed < 0:
            raise InputError("--timeout must be above 0, --memory and --first-seed at least 0.")
        if self.ray is not None:
            from torc.benchmark.ray_pool import load_ray

            load_ray()  # now rather than after the planners were checked
        store = Store(self.out)
        store.check()
        spec, problems = self._plan()  # before the directory is made: wrong arguments leave nothing
        if self.dry_run:
            store.extended(spec)
            for trial in store.left(spec)[: self.limit]:
                tell(f"{trial.id[:10]}  {trial.planner.label} on {trial.problem.name}, seed {trial.seed}")
            self._sum_up(store, spec, 0, 0)
            return 0
        with store.locked():
            return self._play(store, spec, problems)

    def _plan(self) -> tuple[BenchSpec, dict[str, Problem]]:
        """Return the trials that the options describe, and the problems by name."""
        import torc
        from torc.benchmark.spec import find_around, find_problems, make_spec, shard_of, under_variants
        from torc.problems.problem import robot_hint
        from torc.robots.loading import load_robot
        from torc.specs.conditions import variants

        problems, robot = find_problems(self.problems), load_robot(self.conditions.robot)
        hints = Counter(robot_hint(problem, robot.name, robot.source) for problem in problems.values())
        for hint in filter(None, hints):
            tell(f"{hints[hint]} of {len(problems)} problem(s): {hint}")
        around = find_around(self.conditions)
        of_file = self.own_planners if self.planners == type(self).planners else ()
        planners = planners_of(of_file or [(name, {}) for name in split_names(self.planners)], self.vlm)
        planners = under_variants(planners, self.conditions, variants(self.sweep))
        seeds = range(self.first_seed, self.first_seed + self.repeats)
        spec = make_spec(tuple(problems), planners, seeds, around, torc.__version__)
        shard = spec if self.shard is None else shard_of(spec, self.shard)
        return shard, {problem.name: problem for problem in problems.values()}

    def _play(self, store: Store, spec: BenchSpec, problems: dict[str, Problem]) -> int:
        from torc.benchmark.playing import run_missing, shown
        from torc.benchmark.store import begin_call, calls, end_call
        from torc.pipeline.warm_up import MESSAGE, kernel_cache
        from torc.trials.versions import differing, versions, versions_text

        store.extend(spec, problems)
        left = len(store.left(spec))
        todo = left if self.limit is None else min(left, self.limit)
        shard = f"Shard {self.shard}: " if self.shard else ""
        done = f"{len(spec.trials) - left} complete already"
        tell(f"{shard}{len(spec.trials)} trials, {done}, {todo} to play now.")
        played_with = [call["versions"] for call in calls(store.root)[-1:]]
        if changed := differing(map(versions_text, [*played_with, versions()])):
            tell(f"The trials in {store.root} were played with other versions: {', '.join(changed)}.")
        if todo and not kernel_cache()[1]:
            tell(MESSAGE)
        completed: list[bool] = []
        with self._backend(spec, problems, todo) as (backend, facts), shown(todo) as show:
            begin_call(store.root, **facts, **({"shard": self.shard} if self.shard else {}))

            def listen(trial: PlannedTrial, result: TrialResult) -> None:
                completed.append(result.completed)
                show(trial, result)

            try:
                cache = self.vlm.cache()
                run_missing(
                    store,
                    spec,
                    backend,
                    limit=self.limit,
                    vlm_cache=cache,
                    pictures=not self.no_pictures,
                    listener=listen,
                )
            except KeyboardInterrupt:
                tell("Stopped. The same command goes on from here.")
                raise
            finally:
                errored, missing = completed.count(False), len(store.left(spec))
                end_call(store.root, played=len(completed), errored=errored, missing=missing)
        self._sum_up(store, spec, len(completed), errored)
        return 1 if errored else 0

    @contextmanager
    def _backend(
        self, spec: BenchSpec, problems: Mapping[str, Problem], todo: int
    ) -> Iterator[tuple[Backend, dict[str, Any]]]:
        """Provide the backend that plays the trials, and its facts for the manifest."""
        from torc.benchmark.local_pool import LocalPool, PoolConfig

        limits = PoolConfig(self.workers, self.timeout, int(self.memory * 2**30) if self.memory else None)
        if self.ray is None or not todo:
            workers = self.workers or os.cpu_count() or 1
            yield LocalPool(replace(limits, workers=workers)), {"workers": workers}
            return
        from torc.benchmark.ray_pool import ray_pool

        with ray_pool(self.ray, limits, spec, problems) as pool:
            facts = pool.facts()
            tell(f"Ray: {facts['cpus']} CPUs on {len(facts['machines'])} machine(s).")
            yield pool, {"workers": self.workers or facts["cpus"], "ray": facts}

    def _sum_up(self, store: Store, spec: BenchSpec, played: int, errored: int) -> None:
        """Report the state of the benchmark, and what to do next."""
        missing = len(store.left(spec))
        facts = {"trials": len(spec.trials), "played": played, "errored": errored, "missing": missing}
        if self.json:
            print_json({**facts, "directory": str(store.root)})
            return
        tell(", ".join(f"{what}: {n}" for what, n in facts.items()))
        if missing:
            among = ", errored ones among them" if errored else ""
            plays = f"the missing ones{among}."
            if self.limit is not None and self.limit < missing:
                plays = f"{self.limit} more{among}; without --limit, it plays all {missing}."
            tell(f"The same command plays {plays}")
        if missing < len(spec.trials):
            tell(f"torc report {shlex.quote(str(store.root))}")
