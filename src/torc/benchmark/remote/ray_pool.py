"""Trials over the machines of a Ray cluster. Only this machine writes the store: trials come back as data.

The only file that imports Ray. What happens on the other machines is in `node`.
"""

import logging
import os
import pickle
import socket
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from torc.benchmark.dispatch import Ending, Failure, FailureKind, Task, Work
from torc.benchmark.remote.errand import Luggage, torc_facts
from torc.benchmark.remote.sending import errand_of, take_home
from torc.errors import InputError, MissingDependencyError, TorcError, extra_remedy

LOCAL = "local"
"""The address that starts a cluster of this machine alone."""
AUTO = "auto"
"""The address that stands for the cluster that this machine belongs to."""
_LOSSES = 5
"""How often a trial is played again when the machine or the process that was at it is lost."""
_ANSWER_S = 5.0
"""How long the head of a cluster may take to answer at all."""
_TURN_S = 2.0
"""How long a call of Ray's waits, so that machines that join get work."""
_STORE_BYTES = 256 * 2**20
"""Ray's memory for trials on their way, of some megabytes each, on a cluster started here; more goes to its disk."""
_NO_TELEMETRY = {"RAY_USAGE_STATS_ENABLED": "0"}


@dataclass
class _Attempt:
    """A task that is being played, for the n-th time."""

    task: Task
    losses: int = 0


class RayPool:
    """A `Backend` for tasks whose argument is an `Order`; made by `ray_pool`.

    Args:
        ray: the library, connected.
        luggage: what goes to every machine.
        workers: trials at the same time; 0 for as many as the cluster has CPUs.
        say: told of machines that are lost.
    """

    def __init__(self, ray: ModuleType, luggage: Luggage, workers: int, say: Callable[[str], None]) -> None:
        self._ray, self._workers, self._say = ray, workers, say
        self._key = uuid.uuid4().hex
        self._luggage = ray.put(pickle.dumps(luggage))
        self._there = ray.remote(num_cpus=1, max_retries=0)(_far_side())
        self._waited = False

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """An ending per task, as they end; by then its order's directory is as if it had been played here.

        Raises:
            InputError: a machine of the cluster would play something else.
            TorcError: no machine can play, or the cluster is lost as a whole.
        """
        left = deque(_Attempt(task) for task in tasks)
        running: dict[Any, _Attempt] = {}
        try:
            while left or running:
                while left and len(running) < self._room():
                    attempt = left.popleft()
                    running[self._send(work, attempt.task)] = attempt
                done, _ = self._ray.wait(list(running), num_returns=1, timeout=_TURN_S)
                for ref in done:
                    attempt = running.pop(ref)
                    ending = self._ending(attempt, ref)
                    if ending is None:
                        left.appendleft(attempt)
                    else:
                        yield ending
        except self._ray.exceptions.RayError as error:
            raise TorcError(
                f"The Ray cluster is lost: {error}. The same command goes on when there is one again."
            ) from error

    def facts(self) -> dict[str, Any]:
        """What the cluster is made of, for the manifest."""
        nodes = [n for n in self._ray.nodes() if n["Alive"]]
        machines = sorted({n["NodeManagerHostname"] for n in nodes})
        return {
            "nodes": len(nodes),
            "machines": machines,
            "cpus": self._cpus(),
            "version": self._ray.__version__,
        }

    def _cpus(self) -> int:
        return int(self._ray.cluster_resources().get("CPU", 0))

    def _room(self) -> int:
        """Trials in flight: some more than can be played, so that no CPU waits for the next one."""
        cpus = self._cpus()
        if not cpus and not self._waited:
            self._say("No machine with a CPU is in the Ray cluster: waiting for one to join. Ctrl-C stops.")
        self._waited = not cpus
        return self._workers if 0 < self._workers <= cpus else cpus + cpus // 4 + 1

    def _send(self, work: Work, task: Task) -> Any:
        errand = pickle.dumps(errand_of(work, task.argument))
        # In a list, what a reference stands for is not sent along: only a process that is new fetches the luggage.
        return self._there.remote(torc_facts(), self._key, [self._luggage], errand)

    def _ending(self, attempt: _Attempt, ref: Any) -> Ending | None:
        """How a task ended; None if what was at it is lost."""
        task, errors = attempt.task, self._ray.exceptions
        try:
            returned = self._ray.get(ref)
        except errors.RayError as error:
            return self._lost(attempt, error)
        if isinstance(returned, str):
            raise InputError(returned)
        take_home(task.argument, returned)
        return Ending(task.key, returned.outcome)

    def _lost(self, attempt: _Attempt, error: Exception) -> Ending | None:
        errors = self._ray.exceptions
        attempt.losses += 1
        why = str(error).strip().splitlines()[-1 if isinstance(error, errors.RayTaskError) else 0]
        if attempt.losses <= _LOSSES:
            self._say(f"A trial is played again, since what was at it is lost: {why}")
            return None
        if isinstance(error, errors.RayTaskError):
            raise TorcError(f"The machines of the Ray cluster cannot play: {why}")
        kind = FailureKind.MEMORY if isinstance(error, errors.OutOfMemoryError) else FailureKind.CRASHED
        text = f"What was at it was lost {attempt.losses} times, on any machine, the last time so: {why}"
        return Ending(attempt.task.key, Failure(kind, text))


@contextmanager
def ray_pool(
    address: str, workers: int, luggage: Luggage, say: Callable[[str], None] = print
) -> Iterator[RayPool]:
    """A pool, connected to Ray while the context lasts; at its end Ray ends what still runs.

    Nothing is cancelled before that: Ray 2.60 may abort the process that asks for it. What a killed process leaves on
    its disk the next one there removes.

    Args:
        address: "local" starts a cluster of this machine; "auto" finds the one that this machine belongs to;
            HOST:PORT is that one's head.
        workers: trials at the same time; 0 for as many as there are CPUs.
        luggage: what goes to every machine.
        say: told what happens.

    Raises:
        MissingDependencyError: the extra `ray` is not installed.
        InputError: there is no such cluster, or not with this Ray and Python.
    """
    ray = load_ray()
    _connect(ray, address, workers)
    try:
        yield RayPool(ray, luggage, workers, say)
    finally:
        ray.shutdown()


def load_ray() -> ModuleType:
    """The library. Raises MissingDependencyError."""
    os.environ.update(_NO_TELEMETRY)
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        raise MissingDependencyError("Ray, which `torc bench --ray` uses,", extra_remedy("ray")) from error
    return ray


def _connect(ray: ModuleType, address: str, workers: int) -> None:
    if "://" in address:
        raise InputError(
            f"'{address}' is the address of a Ray client. Start `torc bench` on a machine that belongs to the cluster, "
            "with --ray auto."
        )
    if address not in (LOCAL, AUTO):
        _call(address)
    options: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
    if address == LOCAL:
        options |= {"num_cpus": workers or os.cpu_count() or 1, "object_store_memory": _STORE_BYTES}
        options |= {"include_dashboard": False}
    try:
        ray.init(address=address, **options)
    except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        raise _no_cluster(address, error) from error


def _call(address: str) -> None:
    """Whether anybody answers there: Ray itself would try for minutes. Raises InputError."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit():
        raise InputError(f"--ray takes auto, local, or HOST:PORT of the head of a cluster, not '{address}'.")
    try:
        socket.create_connection((host.strip("[]"), int(port)), _ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise _no_cluster(address, error) from error


def _no_cluster(address: str, error: Exception) -> InputError:
    return InputError(
        f"No Ray cluster can be used at '{address}' ({str(error).strip()}). `ray start --head` starts one, and "
        "`ray start --address HEAD:PORT` has a machine join it, this one too; --ray local needs neither."
    )


def _far_side() -> Callable[..., Any]:
    """What Ray calls on another machine: a function that travels whole, to say so where torc is missing there."""

    def play(torc, key, luggage, errand):  # type: ignore[no-untyped-def]  # types would need torc to be there
        import socket

        import ray

        try:
            from torc.benchmark.remote.node import answer
        except ImportError as error:
            place = socket.gethostname()
            return f"{place} cannot play: torc cannot be loaded there ({error}). Install it on every machine."
        return answer(torc, key, lambda: ray.get(luggage[0]), errand)

    return play
