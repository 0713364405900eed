"""Trials over the machines of a Ray cluster: each is played there as in the local pool, and sent back.

Ray sends the user's files along, as its working directory, and repeats on another machine what a lost one was playing.
Only this machine writes the store.
"""

import logging
import os
import pickle
import shutil
import socket
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from torc.benchmark.local_pool import Ending, Failure, FailureKind, PoolConfig, Task, Work
from torc.benchmark.playing import Order
from torc.benchmark.ray_worker import CODE, play_remotely, torc_facts
from torc.benchmark.spec import BenchSpec
from torc.benchmark.store import TRIAL
from torc.errors import InputError, MissingDependencyError, TorcError, extra_remedy
from torc.io.results import write_json
from torc.objects.library import ENVIRONMENT_VARIABLE, find_stored
from torc.problems.problem import Problem, save_problem
from torc.registry.kinds import STAGES
from torc.robots.loading import load_robot
from torc.robots.names import robot_names
from torc.specs.conditions import varied
from torc.specs.spec_files import to_plain
from torc.vlm.cache import CacheMode
from torc.workspace.workspace_files import workspace_names

_OBJECTS, _PROBLEMS, _ROBOT, _WORKSPACE = "own-objects", "own-problems", "own-robot", "own-workspace.yaml"
"""Folders below Ray's working directory, beside CODE."""
_NOT_CODE = ("__pycache__", "node_modules", "site-packages")
_RETRIES = 5
"""How often a trial is repeated when its machine or process is lost."""
_ANSWER_S = 5.0
"""How long the head of a cluster may take to answer at all, seconds: Ray itself would try for minutes."""
_STORE_BYTES = 256 * 2**20
"""Ray's memory for trials in transit, some megabytes each, on a cluster started here; the rest goes to its disk."""


class RayPool:
    """A `Backend` for tasks whose argument is an `Order`; made by `ray_pool`.

    With 0 workers as many trials are played at once as there are CPUs. `there` holds the paths of user-defined robot
    and workspace files on the other machines, by field.
    """

    def __init__(self, ray: ModuleType, limits: PoolConfig, there: Mapping[str, str]) -> None:
        self._ray, self._limits, self._there = ray, limits, there
        self._play = ray.remote(num_cpus=1, max_retries=_RETRIES)(play_remotely)

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """Yield an ending per task, as they end; its order's directory is then as if it had been played here.

        Raises TorcError if a machine cannot play, or would play something else, or the whole cluster is lost.
        """
        left, running = deque(tasks), dict[Any, Task]()
        try:
            while left or running:
                # Twice as many as can be played, so that no CPU waits for the next one.
                while left and len(running) < (self._limits.workers or 2 * max(1, self._cpus())):
                    task = left.popleft()
                    running[self._play.remote(*self._sent(work, task))] = task
                (ref,), _ = self._ray.wait(list(running))
                yield self._ending(running.pop(ref), ref)
        except self._ray.exceptions.RayError as error:
            text = f"The Ray cluster is lost: {error}. The same command goes on when there is one again."
            raise TorcError(text) from error

    def facts(self) -> dict[str, Any]:
        nodes = [n["NodeManagerHostname"] for n in self._ray.nodes() if n["Alive"]]
        facts = {"nodes": len(nodes), "machines": sorted(set(nodes)), "cpus": self._cpus()}
        return facts | {"version": self._ray.__version__}

    def _cpus(self) -> int:
        return int(self._ray.cluster_resources().get("CPU", 0))

    def _sent(self, work: Work, task: Task) -> tuple[Any, ...]:
        """Return the arguments of `play_remotely`, with the paths of the user's files on the other machines."""
        order: Order = task.argument
        trial, vlm_cache, shared = order.trial, order.vlm_cache, None
        if vlm_cache is not None and vlm_cache.mode is not CacheMode.OFF:
            shared = vlm_cache.directory.absolute()
            shared.mkdir(parents=True, exist_ok=True)
            vlm_cache = replace(vlm_cache, directory=shared)
        around = replace(trial.around, conditions=varied(trial.around.conditions, self._there))
        problem = order.problem if trial.problem.shipped else f"{_PROBLEMS}/{trial.problem.name}.yaml"
        there = replace(order, trial=replace(trial, around=around), problem=problem, vlm_cache=vlm_cache)
        limits = replace(self._limits, workers=1)
        return pickle.dumps((work, there)), task.log.name, limits, torc_facts(), shared

    def _ending(self, task: Task, ref: Any) -> Ending:
        errors, order = self._ray.exceptions, task.argument
        try:
            outcome, files = self._ray.get(ref)
        except (errors.RayTaskError, errors.RuntimeEnvSetupError) as error:
            why = getattr(error, "cause", None) or str(error).strip().splitlines()[-1]
            raise TorcError(f"A machine of the Ray cluster cannot play: {why}") from error
        except errors.RayError as error:
            kind = FailureKind.MEMORY if isinstance(error, errors.OutOfMemoryError) else FailureKind.CRASHED
            why = str(error).strip().splitlines()[0]
            text = f"What was at it was lost {_RETRIES + 1} times, on any machine, the last time so: {why}"
            return Ending(task.key, Failure(kind, text))
        for name, content in files.items():
            path = order.work / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        for path in order.work.glob(f"{TRIAL}*/spec.json"):
            write_json(path, to_plain(order.trial.spec(order.problem), order.trial.sources))
        return Ending(task.key, outcome)


@contextmanager
def ray_pool(
    address: str, limits: PoolConfig, spec: BenchSpec, problems: Mapping[str, Problem]
) -> Iterator[RayPool]:
    """Provide a pool, connected to Ray while the context lasts; Ray then ends the tasks that still run.

    `address` is "local" (starts a cluster of this machine), "auto" (the one that this machine belongs to) or HOST:PORT
    of a head. Raises MissingDependencyError; InputError: there is no such cluster, or not with this Ray and Python.
    """
    ray = load_ray()
    with TemporaryDirectory() as own:
        there = _gather(spec, problems, Path(own))
        environment = {"working_dir": own, "env_vars": {ENVIRONMENT_VARIABLE: _OBJECTS}}
        options: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
        if address == "local":
            options |= {"num_cpus": limits.workers or os.cpu_count() or 1, "include_dashboard": False}
            options |= {"object_store_memory": _STORE_BYTES}
        try:
            if address not in ("local", "auto"):
                host, _, port = address.rpartition(":")
                socket.create_connection((host.strip("[]"), int(port)), _ANSWER_S).close()
            ray.init(address=address, runtime_env=environment, **options)
        except Exception as error:  # Ray raises plain ones, too
            raise InputError(
                f"No Ray cluster can be used at '{address}' ({str(error).strip()}). --ray takes auto, local, or "
                "HOST:PORT of a cluster's head. `ray start --head` starts one, and `ray start --address HEAD:PORT` has "
                "a machine join it, this one too; --ray local needs neither."
            ) from error
        try:
            yield RayPool(ray, limits, there)
        finally:
            ray.shutdown()


def load_ray() -> ModuleType:
    """Return the library, without its telemetry. Raises MissingDependencyError."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        raise MissingDependencyError("Ray, which `torc bench --ray` uses,", extra_remedy("ray")) from error
    return ray


def _gather(spec: BenchSpec, problems: Mapping[str, Problem], own: Path) -> dict[str, str]:
    """Copy the user's files that the trials need to a directory; return where robot and workspace are in it."""
    for name in (_OBJECTS, _PROBLEMS):
        (own / name).mkdir()
    for problem in spec.problems:
        if not problem.shipped:
            save_problem(problems[problem.name], own / _PROBLEMS / f"{problem.name}.yaml")
    for model in {o.model for problem in problems.values() for o in problem.ordered()}:
        if stored := find_stored(model):
            shutil.copytree(stored, own / _OBJECTS / model)
    vlms = (p.spec.vlm.provider for p in spec.planners if p.spec.vlm)
    stages = (getattr(spec.around.under(p).conditions, stage) for p in spec.planners for stage in STAGES)
    if any(":" in part for part in (*stages, *(p.spec.name for p in spec.planners), *vlms)):
        for path in Path.cwd().rglob("*.py"):
            inside = path.relative_to(Path.cwd())
            if not any(name.startswith(".") or name in _NOT_CODE for name in inside.parts):
                _copy(path, own / CODE / inside)
    around, there = spec.around.conditions, dict[str, str]()
    if around.workspace not in workspace_names():
        _copy(Path(around.workspace), own / _WORKSPACE)
        there["workspace"] = _WORKSPACE
    if around.robot not in robot_names():
        from mujoco import mju_getXMLDependencies

        mjcf = load_robot(around.robot).mjcf_path
        files = [Path(f).resolve() for f in (around.robot, *mju_getXMLDependencies(str(mjcf)))]
        root = os.path.commonpath([f.parent for f in files])
        for file in files:
            _copy(file, own / _ROBOT / file.relative_to(root))
        there["robot"] = f"{_ROBOT}/{files[0].relative_to(root).as_posix()}"
    return there


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
