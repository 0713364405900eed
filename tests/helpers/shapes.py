"""While tests run, annotated arrays are checked: kind of number, number of axes, sizes that must agree.

jaxtyping's own import hook does the same, but makes the tests a third slower.
"""

import functools
import importlib.machinery
import inspect
import sys
import types
import typing
from collections.abc import Callable
from importlib.abc import MetaPathFinder
from typing import Any

import jaxtyping
import numpy as np


def check_annotations() -> None:
    """Every function and record of torc that is imported from now on checks its arrays at each call."""
    sys.meta_path.insert(0, _Finder())


class _Finder(MetaPathFinder):
    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        if not name.startswith(("torc.", "torc_")):
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = _Loader(name, spec.loader.path)
        return spec


class _Loader(importlib.machinery.SourceFileLoader):
    def exec_module(self, module: types.ModuleType) -> None:
        super().exec_module(module)
        # Numba compiles what a compiled kernel's module holds, not a wrapper around it.
        if "njit" not in module.__dict__:
            _wrap_all(module, module.__name__)


def _wrap_all(holder: Any, module: str) -> None:
    for name, value in list(vars(holder).items()):
        if isinstance(value, classmethod | staticmethod):
            setattr(holder, name, type(value)(checked(value.__func__)))
        elif isinstance(value, property) and value.fget is not None:
            setattr(holder, name, property(checked(value.fget), value.fset, doc=value.__doc__))
        elif getattr(value, "__module__", None) == module and inspect.isclass(value):
            _wrap_all(value, module)
        elif getattr(value, "__module__", None) == module and inspect.isfunction(value):
            setattr(holder, name, checked(value))


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which refuses arrays that are not as annotated; other types are mypy's business."""
    hints = {name: hint for name, hint in function.__annotations__.items() if _is_array(hint)}
    if not hints or inspect.isgeneratorfunction(function):
        return function
    names = list(inspect.signature(function).parameters)
    returned = hints.pop("return", None)
    known: set[Any] = set()
    """Kinds and shapes of arguments, and of these with a result, that were found right: nothing else counts."""

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        if jaxtyping.config.jaxtyping_disable:
            return function(*args, **kwargs)
        given = {n: v for n, v in (*zip(names, args, strict=False), *kwargs.items()) if n in hints}
        facts = tuple((name, _facts(value)) for name, value in given.items())
        if facts not in known:
            _check(function, given, hints)
            known.add(facts)
        result = function(*args, **kwargs)
        if returned is not None and (facts, _facts(result)) not in known:
            _check(function, {**given, "return": result}, {**hints, "return": returned})
            known.add((facts, _facts(result)))
        return result

    return wrapper


def _facts(value: Any) -> Any:
    return (value.dtype.char, value.shape) if isinstance(value, np.ndarray) else type(value)


def _is_array(hint: Any) -> bool:
    if isinstance(hint, types.UnionType):
        return any(map(_is_array, typing.get_args(hint)))
    return isinstance(hint, type) and issubclass(hint, jaxtyping.AbstractArray)


def _check(function: Callable[..., Any], values: dict[str, Any], hints: dict[str, Any]) -> None:
    with jaxtyping.jaxtyped("context"):
        for name, value in values.items():
            if not isinstance(value, hints[name]):
                found = f"{value.dtype} {value.shape}" if hasattr(value, "shape") else type(value).__name__
                raise TypeError(f"{function.__qualname__}: {name} is {found}, not {hints[name]}")
