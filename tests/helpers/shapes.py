"""While tests run, annotated arrays are checked: kind of number, number of axes, sizes that must agree."""

import functools
import inspect
import types
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jaxtyping

import torc


def check_annotations() -> None:
    """Every function and record of torc that is imported from now on checks its arrays at each call.

    Compiled kernels are left out: numba compiles what it is given, not a wrapper around it.
    """
    root = Path(torc.__file__).parent
    modules = [
        ".".join(path.relative_to(root.parent).with_suffix("").parts)
        for path in root.rglob("*.py")
        if path.name != "__init__.py" and "njit" not in path.read_text()
    ]
    jaxtyping.install_import_hook(modules, "tests.helpers.shapes.checked")


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which refuses arrays that are not as annotated; other types are mypy's business."""
    hints = {name: hint for name, hint in function.__annotations__.items() if _is_array(hint)}
    if not hints or inspect.isgeneratorfunction(function):
        return function
    signature = inspect.signature(function)

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        bound = signature.bind(*args, **kwargs)
        for name, hint in hints.items():
            if name in bound.arguments:
                _check(function, name, bound.arguments[name], hint)
        result = function(*args, **kwargs)
        if "return" in hints:
            _check(function, "return", result, hints["return"])
        return result

    return wrapper


def _is_array(hint: Any) -> bool:
    if isinstance(hint, types.UnionType):
        return any(map(_is_array, typing.get_args(hint)))
    return isinstance(hint, type) and issubclass(hint, jaxtyping.AbstractArray)


def _check(function: Callable[..., Any], name: str, value: Any, hint: Any) -> None:
    if not isinstance(value, hint):
        shape = f"{value.dtype} {value.shape}" if hasattr(value, "shape") else type(value).__name__
        raise TypeError(f"{function.__qualname__}: {name} is {shape}, not {hint}")
