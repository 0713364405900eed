"""What happens on a machine that plays for another one: a trial is played aside and goes back as data.

It is played by the local pool's means, in a child process with the same limits, so that a crash, a hang or too much
memory ends that process and nothing else.
"""

import atexit
import pickle
import shutil
import socket
import tempfile
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from torc.benchmark.dispatch import Task
from torc.benchmark.local_pool import STARTS, Processes, no_start, open_processes
from torc.benchmark.remote.aside import Aside
from torc.benchmark.remote.errand import Errand, Luggage, Returned, TorcFacts, Unfit, torc_facts
from torc.benchmark.remote.parcel import pack, unpack
from torc.benchmark.remote.trip import Trip


def travel(trip: Trip) -> Any:
    """Called in the child process, which alone loads what a trial needs."""
    from torc.benchmark.remote.child import play_trip

    return play_trip(trip)


def answer(torc: TorcFacts, key: str, luggage: Callable[[], bytes], errand: bytes) -> Returned | str:
    """Play an errand, or say why this machine must not. The process that plays stays for the next one.

    What comes pickled is opened only where torc is known to be the same.

    Args:
        torc: of the machine that sends it.
        key: of its luggage.
        luggage: gives a pickled Luggage.
        errand: a pickled Errand.

    Raises:
        TorcError, OSError: this machine cannot play at all, e.g. for lack of disk.
    """
    found = _other_torc(dict(torc)) or _seat(key, luggage).play(pickle.loads(errand))
    return f"{socket.gethostname()} cannot play: {found.text}" if isinstance(found, Unfit) else found


class Seat:
    """Plays errands one after another."""

    def __init__(self, luggage: Luggage) -> None:
        self._limits, self._probe = luggage.limits, luggage.probe
        self._stack = ExitStack()
        self._processes: Processes | None = None
        self._aside = Aside()
        self._root = self._aside.path
        atexit.register(self.close)
        self._code, self._objects = self._root / "code", self._root / "objects"
        unpack(luggage.code, self._code)
        unpack(luggage.objects, self._objects)

    def play(self, errand: Errand) -> Returned | Unfit:
        """How it ended. Raises as `answer`."""
        if self._probe is not None and not self._probe.exists():
            return Unfit(
                f"It does not see the VLM cache '{self._probe.parent}'. With Ray a cache has to lie in a directory "
                "that all machines share, by the same path."
            )
        directory = Path(tempfile.mkdtemp(dir=self._root))
        try:
            trip = Trip(errand.cargo, directory, self._problem(errand), self._code, self._objects)
            outcome = self._outcome(Task(errand.key, trip, directory / errand.log))
            if isinstance(outcome, Unfit):
                return outcome
            return Returned(outcome, pack(directory, ends={errand.log: errand.log_bytes}))
        finally:
            shutil.rmtree(directory, ignore_errors=True)

    def close(self) -> None:
        """End the process and leave nothing on the disk."""
        self._stop()
        self._aside.remove()

    def _problem(self, errand: Errand) -> Path | None:
        if errand.problem is None:
            return None
        name, content = errand.problem
        path = self._root / name
        path.write_bytes(content)
        return path

    def _outcome(self, task: Task) -> Any:
        for _ in range(STARTS):
            if self._processes is None:
                self._processes = self._stack.enter_context(open_processes(self._limits))
            try:
                return self._processes.outcome(self._processes.schedule(travel, task))
            except BrokenProcessPool:
                self._stop()
            except BaseException:  # whatever ends this, what plays must not go on
                self._stop()
                raise
        raise no_start()

    def _stop(self) -> None:
        self._processes = None
        self._stack.close()


_seats: dict[str, Seat] = {}
"""The seat of this process. Its child lives from trial to trial, since starting one takes seconds."""


def _seat(key: str, luggage: Callable[[], bytes]) -> Seat:
    if key not in _seats:
        while _seats:  # another benchmark's
            _seats.popitem()[1].close()
        _seats[key] = Seat(pickle.loads(luggage()))
    return _seats[key]


def _other_torc(wanted: dict[str, str]) -> Unfit | None:
    here = dict(torc_facts())
    differ = [f"{k} is {here.get(k, 'missing')}, not {v}" for k, v in wanted.items() if here.get(k) != v]
    if not differ:
        return None
    return Unfit(
        f"Its results could not be compared, since there {', '.join(differ)}. Install the same checkout of torc there "
        "(scripts/setup ray), and start its Ray again."
    )
