"""Parts that anybody can bring, task planners, VLM clients and grasp planners: from a name to the part.

A name is one that torc ships, one that an installed package registered as an entry point, "module:Class", or
"path/to/file.py:Class". A stranger's code may fail in any way: what comes out is an InputError where the part is made,
and the part's own error where it is used.
"""

import inspect
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path, PurePath
from types import ModuleType
from typing import Any

from torc.errors import InputError, TorcError, UnknownNameError
from torc.fingerprints import fingerprint
from torc.satellites import not_installed, satellite_of_part


@dataclass(frozen=True)
class PartKind:
    """A kind of part that can be exchanged: `what` it is in messages, the `group` of entry points by which packages
    register theirs, the method that every one has, with its arguments, and name -> "module:Class" (or a function that
    makes one) of those that come with torc.
    """

    what: str
    group: str
    call: str
    built_in: Mapping[str, str]

    @property
    def title(self) -> str:
        """Beginning of a sentence."""
        return self.what[0].upper() + self.what[1:]

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.call.partition("(")[0]

    def ships(self, name: str) -> bool:
        """Whether the part of that name comes with torc or a satellite, so that its version stands for its code."""
        return name in self.built_in or satellite_of_part(self.group, name) is not None


def unknown_part(kind: PartKind, name: str, known: Iterable[str]) -> UnknownNameError:
    """The error for a name that nobody registered; says how a part of one's own is named."""
    more = ", or your own as module:Class or path/to/file.py:Class"
    return UnknownNameError(kind.what, name, list(known), more)


def short_part_name(name: str) -> str:
    """A name that can stand in a file's name: "path/to/file.py:Class" becomes "file.Class", as "file:Class" does."""
    module, colon, attribute = name.partition(":")
    return f"{PurePath(module).name.removesuffix('.py')}.{attribute}" if colon else name


def part_paths(kind: PartKind) -> dict[str, str]:
    """All known names with their "module:Class": the shipped ones and those of installed packages.

    No other package can take a shipped name, nor that of a satellite.
    """
    installed = {}
    for point in entry_points(group=kind.group):
        owner = satellite_of_part(kind.group, point.name)
        if owner is None or point.value.startswith(f"{owner.module}."):
            installed[point.name] = point.value
    return installed | dict(kind.built_in)


def make_part(
    kind: PartKind, name: str, options: Mapping[str, Any], offered: Mapping[str, Any] | None = None
) -> Any:
    """The part of that name, or the class at "module:Class", made with these options, and with what is `offered` as far
    as it has parameters of these names.

    Raises UnknownNameError for a name nobody registered, and InputError where the class cannot be imported, does not
    take the options, or makes no such part; the cause is in the text.
    """
    factory, what = load_part(kind, name), f"{kind.title} '{name}'"
    signature = _signature(factory)
    given = {k: v for k, v in (offered or {}).items() if k in parameters(factory)} | dict(options)
    try:
        if signature is not None:
            signature.bind(**given)
    except TypeError as error:
        raise InputError(
            f"{what} does not take the options {sorted(given)}: {error}. It takes {signature}."
        ) from error
    try:
        part = factory(**given)
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # a stranger's code may fail in any way
        raise InputError(f"{what} could not be made: {type(error).__name__}: {error}.") from error
    if not callable(getattr(part, kind.method, None)):
        raise InputError(f"{what} needs a method `{kind.call}`; {type(part).__name__} has none.")
    return part


def load_part(kind: PartKind, name: str) -> Any:
    """What makes the part of that name, imported but not called. Raises as `make_part`."""
    # To ask all installed packages takes 15 ms, and a trial makes a dozen parts.
    known = kind.built_in if name in kind.built_in else part_paths(kind)
    what = f"{kind.title} '{name}'"
    if name not in known and (owner := satellite_of_part(kind.group, name)):
        raise not_installed(what, owner, owner.parts[kind.group][name])
    if name not in known and ":" not in name:
        raise unknown_part(kind, name, known)
    module_name, _, attribute = known.get(name, name).partition(":")
    if not module_name or not attribute:
        raise InputError(f"{what} must be written module:Class, e.g. my_package.my_module:MyClass.")
    try:
        is_file = module_name.endswith(".py")
        found: Any = _module_of_file(module_name) if is_file else import_module(module_name)
        for part in attribute.split("."):
            found = getattr(found, part)
    except TorcError:
        raise
    except (ModuleNotFoundError, FileNotFoundError) as error:
        here = os.getcwd()
        local = f"the working directory ({here}), " if {here, ""} & set(sys.path) else ""
        raise InputError(
            f"{what}: importing {module_name} failed: {error}. Looked for in {local}this environment and PYTHONPATH."
        ) from error
    except AttributeError as error:
        raise InputError(f"{what}: module {module_name} has no '{attribute}' ({error}).") from error
    except (Exception, SystemExit) as error:  # a stranger's code may fail in any way
        failed = f"importing {module_name} failed with {type(error).__name__}: {error}."
        raise InputError(f"{what}: {failed}") from error
    if not callable(found):
        raise InputError(f"{what} is a {type(found).__name__}, not a class.")
    return found


def registered(group: str) -> dict[str, Callable[[], Any]]:
    """Return what installed packages registered in a group of entry points: what loads it, by name, in order of names.

    Loading raises InputError for what cannot be imported.
    """
    points = sorted(entry_points(group=group), key=lambda point: point.name)
    return {point.name: partial(_loaded, point) for point in points}


def _loaded(point: EntryPoint) -> Any:
    try:
        return point.load()
    except (Exception, SystemExit) as error:  # a stranger's code may fail in any way
        raise InputError(
            f"'{point.name}' of an installed package ({point.value}) cannot be imported: {type(error).__name__}: "
            f"{error}. Repair the package, or uninstall it."
        ) from error


def takes(kind: PartKind, name: str, argument: str) -> bool:
    """Whether the class of that name takes an argument. Raises as `make_part`."""
    return argument in parameters(load_part(kind, name))


def parameters(factory: Any) -> frozenset[str]:
    """Names of the arguments that something takes, as far as it tells."""
    signature = _signature(factory)
    return frozenset() if signature is None else frozenset(signature.parameters)


def refuses(factory: Any, argument: str) -> bool:
    """Whether something tells that it takes no argument of that name."""
    signature = _signature(factory)
    return signature is not None and not any(
        p.name == argument or p.kind is p.VAR_KEYWORD for p in signature.parameters.values()
    )


@contextmanager
def blamed(what: str, error_class: type[TorcError], remedy: str) -> Iterator[None]:
    """Turns whatever a part raises within into error_class, naming the part, the fault and its line.

    A TorcError of the part's own passes as it is.
    """
    try:
        yield
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # a stranger's code may fail in any way
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise error_class(
            f"{what} failed with {type(error).__name__}: {error} ({last.filename}, line {last.lineno}). {remedy}"
        ) from error


def warm_up(part: object, seen: object) -> None:
    """Calls `part.warm_up(seen)`, a method that parts with kernels of their own may have.

    It uses each of them once on what a planner would be given: a PlanningContext for a task planner, a PickRequest
    for a motion planner.
    """
    method = getattr(part, "warm_up", None)
    if callable(method):
        method(seen)


def kind_of_value(value: Any) -> str:
    """What a value is, for messages."""
    return "None" if value is None else f"a {type(value).__name__}"


def _signature(factory: Any) -> inspect.Signature | None:
    try:
        return inspect.signature(factory)
    except (TypeError, ValueError):  # compiled classes may tell no signature
        return None


def _module_of_file(file: str) -> ModuleType:
    """The module of a file in the working directory or on the search path; it finds the modules beside it.

    It is imported once. Raises FileNotFoundError if there is none.
    """
    path = next((p.resolve() for p in (Path(place, file) for place in ("", *sys.path)) if p.is_file()), None)
    if path is None:
        raise FileNotFoundError(f"there is no file '{file}'")
    name = f"torc_own_{path.stem}_{fingerprint({'path': str(path)})[:8]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"'{path}' cannot be imported")
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    sys.modules[name] = module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
