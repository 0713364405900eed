"""Parts that anybody can bring, task planners, VLM clients and grasp planners: from a name to the part.

A name is one that torc ships, one that an installed package registered as an entry point, "module:Class", or
"path/to/file.py:Class". Shipped names are lazy ("module:Class"), so that asking for one part never imports another's
dependencies. A stranger's code may fail in any way: what comes out is an InputError where the part is made, and the
part's own error where it is used.
"""

import inspect
import os
import shlex
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path, PurePath
from types import ModuleType
from typing import Any

from torc.errors import InputError, TorcError, UnknownNameError


@dataclass(frozen=True)
class PartKind:
    """A kind of part that can be exchanged.

    Attributes:
        what: in messages, e.g. "task planner".
        group: of the entry points by which packages register theirs.
        call: the method that every part of this kind has, with its arguments.
        built_in: name -> "module:Class", or "module:function" that makes one.
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


def unknown_part(kind: PartKind, name: str, known: Iterable[str]) -> UnknownNameError:
    """The error for a name that nobody registered; says how a part of one's own is named."""
    more = f", or your own as module:Class or path/to/file.py:Class.{own_spelling(name)}"
    return UnknownNameError(kind.what, name, list(known), more.removesuffix("."))


def own_spelling(name: str) -> str:
    """A sentence on how to write what a user seems to mean by a file or by dots alone; empty if that is not to be seen.

    It begins with a space, to stand behind others.
    """
    text, _, attribute = name.partition(":")
    file = text.removesuffix(".py") + ".py"
    *module, last = text.split(".")
    if attribute and text.isidentifier():
        return ""
    if text.endswith(".py") or os.path.isfile(file):
        own = f"{file}:{attribute or 'CLASS'}"
    elif not attribute and module and all(part.isidentifier() for part in (*module, last)):
        own = f"{'.'.join(module)}:{last}" if last[0].isupper() else f"{text}:CLASS"
    else:
        return ""
    return "" if own == name else f" Write {shlex.quote(own)}."


def file_of_part(name: str) -> str:
    """The file in "path/to/file.py:Class"; "" for any other name."""
    path, colon, _ = name.partition(":")
    return path if colon and path.endswith(".py") else ""


def short_part_name(name: str) -> str:
    """A name that can stand in a file's name: "path/to/file.py:Class" becomes "file.Class", as "file:Class" does."""
    module, colon, attribute = name.partition(":")
    return f"{PurePath(module).name.removesuffix('.py')}.{attribute}" if colon else name


def part_paths(kind: PartKind) -> dict[str, str]:
    """All known names with their "module:Class": the shipped ones and those of installed packages."""
    installed = {point.name: point.value for point in entry_points(group=kind.group)}
    return installed | dict(kind.built_in)


def make_part(
    kind: PartKind, name: str, options: Mapping[str, Any], offered: Mapping[str, Any] | None = None
) -> Any:
    """The part of that name, or the class at "module:Class", made with these arguments.

    Args:
        kind: what is wanted.
        name: which.
        options: arguments that it must take.
        offered: arguments that are passed only where the class names them.

    Raises UnknownNameError for a name nobody registered, and InputError where the class cannot be imported, does not
    take the options, or makes no such part; the cause is in the text.
    """
    path, factory = _path(kind, name), load_part(kind, name)
    arguments = {k: v for k, v in (offered or {}).items() if k in parameters(factory)} | dict(options)
    part = _construct(factory, f"{kind.title} '{name}' ({path})", arguments)
    if not callable(getattr(part, kind.method, None)):
        raise InputError(
            f"{kind.title} '{name}' ({path}) needs a method `{kind.call}`; {type(part).__name__} has none."
        )
    return part


def load_part(kind: PartKind, name: str) -> Any:
    """What makes the part of that name, imported but not called. Raises as `make_part`."""
    return _load(kind, name, _path(kind, name))


def takes(kind: PartKind, name: str, argument: str) -> bool:
    """Whether the class of that name takes an argument. Raises as `make_part`."""
    return argument in parameters(load_part(kind, name))


@contextmanager
def blamed(what: str, error_class: type[TorcError], remedy: str) -> Iterator[None]:
    """Turns whatever a part raises within into error_class, naming the part, the fault and its line.

    A TorcError of the part's own passes as it is.
    """
    try:
        yield
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # somebody's code: anything may come
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


def _path(kind: PartKind, name: str) -> str:
    known = part_paths(kind)
    if name not in known and ":" not in name:
        raise unknown_part(kind, name, known)
    return known.get(name, name)


def _load(kind: PartKind, name: str, path: str) -> Any:
    what = f"{kind.title} '{name}'"
    module_name, _, attribute = path.partition(":")
    if not module_name or not attribute:
        raise InputError(f"{what} must be written module:Class, e.g. my_package.my_module:MyClass.")
    file = _found_file(what, name, module_name) if file_of_part(path) else None
    try:
        found: Any = import_module(module_name) if file is None else _module_of_file(file)
        for part in attribute.split("."):
            found = getattr(found, part)
    except TorcError:
        raise
    except ModuleNotFoundError as error:
        raise InputError(
            f"{what}: importing {module_name} failed: {error}. {_searched()}{own_spelling(name)}"
        ) from error
    except AttributeError as error:
        raise InputError(f"{what}: module {module_name} has no '{attribute}' ({error}).") from error
    except (Exception, SystemExit) as error:  # a stranger's module may fail in any way while it is imported
        raise InputError(
            f"{what}: importing {module_name} failed with {type(error).__name__}: {error}."
        ) from error
    if not callable(found):
        raise InputError(f"{what}: {path} is a {type(found).__name__}, not a class.")
    return found


def _found_file(what: str, name: str, file: str) -> Path:
    """The file, in the working directory or, like a module, on the search path. Raises InputError if there is none."""
    for place in ("", *sys.path):
        path = Path(place, file)
        if path.is_file():
            return path.resolve()
    raise InputError(f"{what}: there is no file '{file}'. {_searched()}")


def _module_of_file(path: Path) -> ModuleType:
    """The module that a file holds, imported once; it finds the modules beside it, as a script does."""
    name = f"torc_own_{path.stem}_{sha256(str(path).encode()).hexdigest()[:8]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"'{path}' cannot be imported")
    module = module_from_spec(spec)
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _searched() -> str:
    """Where modules are looked for."""
    here = os.getcwd()
    local = f"the working directory ({here}), " if {here, ""} & set(sys.path) else ""
    return f"Looked for in {local}this environment and PYTHONPATH."


def _signature(factory: Any) -> inspect.Signature | None:
    try:
        return inspect.signature(factory)
    except (TypeError, ValueError):  # compiled classes may tell no signature
        return None


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


def _construct(factory: Any, what: str, arguments: dict[str, Any]) -> Any:
    signature = _signature(factory)
    try:
        if signature is not None:
            signature.bind(**arguments)
    except TypeError as error:
        raise InputError(
            f"{what} does not take the options {sorted(arguments)}: {error}. It takes {signature}."
        ) from error
    try:
        return factory(**arguments)
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # as above
        raise InputError(f"{what} could not be made: {type(error).__name__}: {error}.") from error
