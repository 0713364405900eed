"""From the name of a part to the part. User-defined code may fail in any way: a failure while a part is made is an
InputError, a failure in use an error that names the part.
"""

import ast
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path, PurePath
from types import ModuleType
from typing import Any

from torc.errors import InputError, TorcError, UnknownNameError
from torc.io.digests import fingerprint
from torc.registry.context import BuildContext, signature_of
from torc.registry.kinds import FOLDERS, Kind, declarable
from torc.registry.settings import Settings, arguments
from torc.satellites import not_installed, satellite_of_part

PART = "PART"
"""The name of the class in a file in a folder of parts."""


def make_part(
    kind: Kind[Any],
    name: str,
    settings: Settings | None = None,
    context: BuildContext | None = None,
    *,
    rough: bool = False,
) -> Any:
    """Make the part of that name, or the class at "module:Class", with settings by their paths within the part.

    If depth is `rough` (it has a sensor's errors), a part that has default settings for that is made with them. Raises
    UnknownNameError if nobody registered that name, or the part has no such setting; and InputError if the class cannot
    be imported or made, or is not a part of this kind.
    """
    factory = load_part(kind, name)
    return make_with(kind, name, arguments(factory, settings or {}, kind.option, rough), context)


def make_with(kind: Kind[Any], name: str, options: Settings, context: BuildContext | None = None) -> Any:
    """Make the part of that name with these arguments and those that it takes of `context`. Raises like `make_part`."""
    factory, what = load_part(kind, name), f"{kind.title} '{name}'"
    given = (context or BuildContext()).given_to(factory) | dict(options)
    signature = signature_of(factory)
    try:
        signature.bind(**given)
    except TypeError as error:
        raise InputError(
            f"{what} does not take the options {sorted(given)}: {error}. It takes {signature}."
        ) from error
    try:
        part = factory(**given)
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # user-defined code may fail in any way
        raise InputError(f"{what} could not be made: {type(error).__name__}: {error}.") from error
    if not callable(getattr(part, kind.method, None)):
        raise InputError(f"{what} needs a method `{kind.call}`; {type(part).__name__} has none.")
    for fault in trait_faults(kind, part):
        raise InputError(f"{what}: {fault}.")
    return part


def trait_faults(kind: Kind[Any], part: object) -> Iterator[str]:
    """Yield the faults of the traits that a part declares."""
    declared = kind.traits(part)
    for name, default in declarable(kind.base).items():
        value = getattr(declared, name)
        if isinstance(default, bool | str) and not isinstance(value, type(default)):
            wanted = "True or False" if isinstance(default, bool) else "text"
            yield f"`{name}` is {kind_of_value(value)}; it must be {wanted}"
        elif callable(default) and not callable(value):
            yield f"`{name}` is {kind_of_value(value)}; it must be a method"
    if "name" in declarable(kind.base) and not declared.name:
        yield f"it needs a string `name` besides its method `{kind.call}`"


def load_part(kind: Kind[Any], name: str) -> Any:
    """Return what makes the part of that name, imported but not called. Raises like `make_part`."""
    # Asking all installed packages takes 15 ms, and a trial makes a dozen parts.
    shipped = shipped_paths(kind)
    known = shipped if name in shipped else part_paths(kind)
    if name not in known and (satellite := satellite_of_part(kind.group, name)):
        raise not_installed(f"{kind.title} '{name}'", satellite, satellite.parts[kind.group][name])
    if name not in known and ":" not in name:
        raise unknown_part(kind, name, known)
    return load_path(f"{kind.title} '{name}'", known.get(name, name))


def load_path(what: str, path: str) -> Any:
    """Return the class or function at "module:Class" or "path/to/file.py:Class". `what` names it in messages.

    Raises InputError.
    """
    found = load_object(what, path)
    if not callable(found):
        raise InputError(f"{what} is a {type(found).__name__}, not a class.")
    return found


def load_object(what: str, path: str) -> Any:
    """Return any object at "module:name" or "path/to/file.py:name". Raises InputError."""
    module_name, _, attribute = path.partition(":")
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
        raise InputError(f"{what}: {module_name} has no '{attribute}'.") from error
    except (Exception, SystemExit) as error:  # user-defined code may fail in any way
        raise InputError(
            f"{what}: importing {module_name} failed with {type(error).__name__}: {error}."
        ) from error
    return found


def unknown_part(kind: Kind[Any], name: str, known: Iterable[str]) -> UnknownNameError:
    """Return the error for a name that nobody registered."""
    more = ", or your own as module:Class or path/to/file.py:Class"
    return UnknownNameError(kind.what, name, list(known), more)


def part_paths(kind: Kind[Any]) -> dict[str, str]:
    """Return all known names with their "module:Class": shipped parts and those of installed packages."""
    installed = {point.name: point.value for point in entry_points(group=kind.group)}
    return installed | _found(kind, _all_folders())


def shipped_paths(kind: Kind[Any]) -> Mapping[str, str]:
    """Return the names that come with torc, with their "module:PART". Reads only file names."""
    return _found(kind, (FOLDERS,))


def is_shipped(kind: Kind[Any], name: str) -> bool:
    """Return whether torc's version alone determines what this part does; a user-defined part counts by its source."""
    return name in shipped_paths(kind) or satellite_of_part(kind.group, name) is not None


def part_lines(kind: Kind[Any]) -> dict[str, str]:
    """Return a line of help for every known name. No part is imported."""
    points = entry_points(group=kind.group)
    lines = {point.name: f"of the package {point.value.partition('.')[0]}" for point in points}
    lines |= {name: _first_line(path) for name, path in _found(kind, _all_folders()).items()}
    return dict(sorted(lines.items()))


def registered(group: str) -> dict[str, Callable[[], Any]]:
    """Return a loader for each name that installed packages registered in a group of entry points, sorted by name.

    A loader raises InputError for what cannot be imported.
    """
    points = sorted(entry_points(group=group), key=lambda point: point.name)
    return {point.name: partial(_loaded, point) for point in points}


def _loaded(point: EntryPoint) -> Any:
    try:
        return point.load()
    except (Exception, SystemExit) as error:  # user-defined code may fail in any way
        raise InputError(
            f"'{point.name}' of an installed package ({point.value}) cannot be imported: {type(error).__name__}: "
            f"{error}. Repair the package, or uninstall it."
        ) from error


@cache
def _found(kind: Kind[Any], roots: tuple[str, ...]) -> dict[str, str]:
    """Return the parts in the folders of some packages: a part is named like its file, with hyphens."""
    found: dict[str, str] = {}
    for root in reversed(roots):
        folder = f"{root}.{kind.folder}"
        try:
            spec = find_spec(folder)
        except ImportError:  # another package is broken: its parts are missing, others are not
            continue
        for place in () if spec is None else spec.submodule_search_locations or ():
            for file in sorted(Path(place).glob("*.py")):
                if not file.stem.startswith("_"):
                    found[file.stem.replace("_", "-")] = f"{folder}.{file.stem}:{PART}"
    return found


def _all_folders() -> tuple[str, ...]:
    return (FOLDERS, *(point.value for point in entry_points(group=FOLDERS)))


def _first_line(path: str) -> str:
    """Return the first line of the docstring of a part's file."""
    spec = find_spec(path.partition(":")[0])
    if spec is None or spec.origin is None:
        return ""
    text = ast.get_docstring(ast.parse(Path(spec.origin).read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0].rstrip(".")


def short_part_name(name: str) -> str:
    """Return a name that fits into a file's name: "path/to/file.py:Class" becomes "file.Class"."""
    module, colon, attribute = name.partition(":")
    return f"{PurePath(module).name.removesuffix('.py')}.{attribute}" if colon else name


@contextmanager
def blamed(what: str, error_class: type[TorcError], remedy: str) -> Iterator[None]:
    """Turn any exception that a part raises inside into `error_class`, naming the part, the fault and its line.

    A TorcError that the part raises itself passes unchanged.
    """
    try:
        yield
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # user-defined code may fail in any way
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise error_class(
            f"{what} failed with {type(error).__name__}: {error} ({last.filename}, line {last.lineno}). {remedy}"
        ) from error


def kind_of_value(value: Any) -> str:
    """Return the kind of a value, for messages."""
    return "None" if value is None else f"a {type(value).__name__}"


def _module_of_file(file: str) -> ModuleType:
    """Import a file in the working directory or on the search path, once; it finds the modules beside it.

    Raises FileNotFoundError if there is none.
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
