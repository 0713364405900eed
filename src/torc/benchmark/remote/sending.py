"""At home: what goes with a benchmark to other machines, and what is made of what comes back.

Torc itself has to be there, the same one: a trial's id says which torc played it.
"""

import json
import pickle
import shutil
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from torc.benchmark.dispatch import Work
from torc.benchmark.local_pool import PoolConfig
from torc.benchmark.playing import OUTPUT, TRIAL, Order
from torc.benchmark.remote.errand import Errand, Luggage, Returned
from torc.benchmark.remote.parcel import Parcel, pack, unpack
from torc.benchmark.spec import BenchPlanner
from torc.benchmark.store import MAX_SAID
from torc.errors import InputError
from torc.plugins import file_of_part
from torc.records.files import write_json
from torc.scenes.object_store import find_stored
from torc.scenes.problem import Problem
from torc.vlm.cache import CacheConfig, CacheMode

_MAX_CODE_FILES, _MAX_CODE_BYTES = 2000, 20_000_000
_LOG_BYTES = 5 * MAX_SAID
"""They hold all the characters that a store keeps."""
_NOT_CODE = ("__pycache__", "node_modules", "site-packages")


def pack_luggage(
    limits: PoolConfig,
    planners: Iterable[BenchPlanner],
    problems: Iterable[Problem],
    directory: Path,
    probe: Path | None = None,
    grasps: str = "geometric",
) -> Luggage:
    """What these planners and problems need.

    Args:
        limits: see Luggage.
        planners: of the benchmark.
        problems: of the benchmark.
        directory: where modules of the user's are looked for: the working directory.
        probe: see Luggage.
        grasps: the grasp planner.

    Raises:
        InputError: there are too many Python files.
    """
    named = [
        grasps,
        *(name for p in planners for name in (p.spec.name, p.spec.vlm.provider if p.spec.vlm else "")),
    ]
    code = _code(directory) if any(_lies_in(directory, name) for name in named) else Parcel()
    models = sorted({o.model for problem in problems for o in problem.objects})
    return Luggage(limits, code, _objects(models), probe)


@contextmanager
def shared_cache(config: CacheConfig | None) -> Iterator[tuple[CacheConfig | None, Path | None]]:
    """The cache by its full path, and a file in it by which other machines see that it is the same directory."""
    if config is None or config.mode is CacheMode.OFF:
        yield config, None
        return
    whole = CacheConfig(config.directory.absolute(), config.mode)
    if config.mode is CacheMode.RECORD:
        whole.directory.mkdir(parents=True, exist_ok=True)
    elif not whole.directory.is_dir():
        raise InputError(f"There is no VLM cache at '{config.directory}' to replay from.")
    probe = whole.directory / f".shared-{uuid.uuid4().hex}"
    probe.touch()
    try:
        yield whole, probe
    finally:
        probe.unlink(missing_ok=True)


def errand_of(work: Work, order: Order) -> Errand:
    """A trial, ready to be sent. Raises OSError where its problem cannot be read."""
    name = order.trial.problem.name
    problem = None if order.trial.problem.shipped else (f"{name}.yaml", Path(order.problem).read_bytes())
    return Errand(order.trial.id, pickle.dumps((work, order)), OUTPUT, _LOG_BYTES, problem)


def take_home(order: Order, returned: Returned) -> None:
    """The order's directory as if it had been played here. Raises InputError, OSError."""
    shutil.rmtree(order.work, ignore_errors=True)
    unpack(returned.directory, order.work)
    if order.trial.problem.shipped:
        return
    for directory in (order.work / TRIAL, order.work / f"{TRIAL}.partial"):
        path = directory / "spec.json"
        if path.is_file():  # it names the copy that was played
            write_json(path, {**json.loads(path.read_text(encoding="utf-8")), "problem": order.problem})


def _module(name: str) -> str:
    """The top-level package of "module:Class"; "" for names that torc or an installed package knows."""
    module, colon, _ = name.partition(":")
    return module.partition(".")[0] if colon else ""


def _lies_in(directory: Path, name: str) -> bool:
    """Whether the code of a part is below the directory, and has to be sent."""
    places = [str(directory / file_of_part(name))] if file_of_part(name) else _places(_module(name))
    root = directory.resolve()
    return any(Path(p).resolve().is_relative_to(root) and "site-packages" not in p for p in places)


def _places(module: str) -> list[str]:
    """Where a module lies; empty if it is not found."""
    try:
        spec = find_spec(module) if module else None
    except (ImportError, ValueError):
        return []
    if spec is None:
        return []
    return [*(spec.submodule_search_locations or ()), *([spec.origin] if spec.origin else [])]


def _code(directory: Path) -> Parcel:
    """The Python files below a directory, without those of environments and hidden directories."""
    taken = files = 0

    def wanted(path: Path) -> bool:
        nonlocal taken, files
        if path.is_dir():
            hidden = path.name.startswith(".") or path.name in _NOT_CODE
            return not hidden and not (path / "pyvenv.cfg").exists()
        if path.suffix != ".py":
            return False
        files, taken = files + 1, taken + path.stat().st_size
        if files > _MAX_CODE_FILES or taken > _MAX_CODE_BYTES:
            raise InputError(
                f"There are more than {_MAX_CODE_FILES} Python files, or {_MAX_CODE_BYTES // 1_000_000} MB of them, "
                f"below '{directory}', to be sent to all machines. Put the planner into a directory of its own and "
                "start there, or install it as a package on every machine."
            )
        return True

    return Parcel(pack(directory, wanted=wanted).files)


def _objects(models: Iterable[str]) -> Parcel:
    files = []
    for name in models:
        place = find_stored(name)
        if place is not None:
            files += [(f"{name}/{path}", content) for path, content in pack(place).files]
    return Parcel(tuple(files))
