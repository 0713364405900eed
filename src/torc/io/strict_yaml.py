"""YAML from strangers: plain values only, no aliases, tags or repeated keys, and faults in words."""

from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar

import yaml
from pydantic import BeforeValidator, TypeAdapter, ValidationError

from torc.errors import InputError
from torc.io.reading import read_text

_Model = TypeVar("_Model")
_REMEDIES = {
    "missing": "is missing; add it",
    **dict.fromkeys(
        ("extra_forbidden", "unexpected_keyword_argument"),
        "is not a field of this format; remove it or check its spelling",
    ),
    "finite_number": "must be a finite number",
    "string_type": "must be text; put it in quotes",
    "string_unicode": "has characters that are none; remove them",
    "string_pattern_mismatch": "must be 1 to 64 letters, digits, '_', '-' or '.', starting with a letter or digit",
    "tuple_type": "must be a list",
    "too_long": "holds too many entries",
    "too_short": "holds too few entries",
}


FAST_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""LibYAML's loader, several times as fast; PyYAML may be built without it."""
_DEEPEST = 50
"""Most levels of nesting."""


class _PlainLoader(FAST_LOADER):  # type: ignore[misc, valid-type]
    """A SafeLoader that refuses repeated keys, of which one would be lost."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value if isinstance(key.value, str)]
        for key, count in Counter(keys).items():
            if count > 1:
                raise yaml.YAMLError(
                    f"line {node.start_mark.line + 1}: '{key}' is given {count} times; keep one"
                )
        return dict(super().construct_mapping(node, deep))


def _check_plain(text: str) -> None:
    """Refuse YAML that is not plain.

    Raises YAMLError for aliases (a small file could expand to a huge one) and tags (SafeLoader trusts `!!bool`
    blindly), and RecursionError for nesting beyond what people write (LibYAML would exhaust the stack).
    """
    depth = 0
    for event in yaml.parse(text, Loader=_PlainLoader):
        line = f"line {event.start_mark.line + 1}" if event.start_mark else "somewhere"
        if isinstance(event, yaml.AliasEvent):
            raise yaml.YAMLError(f"{line}: aliases (*name) are not supported; write the value out")
        if getattr(event, "tag", None) is not None:
            raise yaml.YAMLError(f"{line}: tags (!name) are not supported; write the plain value")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise RecursionError


def parse_plain_yaml(text: str, source: str, what: str, max_bytes: int, remedy: str) -> dict[Any, Any]:
    """Return the mapping that a YAML text holds, e.g. a "problem" (`what`).

    `source` names the file in errors, `remedy` ends the message about unreadable YAML. Raises InputError if it is too
    long, not YAML, nested too deeply or not a mapping, or has aliases, tags or repeated keys.
    """
    if len(text.encode()) > max_bytes:
        raise InputError(f"{source} is larger than {max_bytes} bytes: that is not a {what} file.")
    try:
        _check_plain(text)
        data = yaml.load(text, Loader=_PlainLoader)  # a SafeLoader: builds plain values only
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise InputError(f"{source} is not readable YAML: {error}. {remedy}") from None
    except RecursionError:
        raise InputError(f"{source} is nested too deeply to be a {what} file.") from None
    if not isinstance(data, dict):
        raise InputError(f"{source} holds no {what}: it must start with 'format: torc-{what}/1'.")
    return data


def validated(
    model: type[_Model], content: Any, head: str, remedy: str = "", remedies: Mapping[str, str] | None = None
) -> _Model:
    """Return plain data as a pydantic model, or as a dataclass with annotations for pydantic.

    Raises InputError: after `head`, such as "my.yaml is not a valid problem file", a line for each field with its fault
    and remedy (see `explain_faults`), and at the end `remedy`.
    """
    try:
        return _adapter(model).validate_python(content)
    except ValidationError as error:
        raise InputError(f"{head}:\n{explain_faults(error, remedies)}\n{remedy}".rstrip()) from None


_adapter: Any = cache(TypeAdapter)


def read_yaml_as(model: type[_Model], path: Path, what: str, max_bytes: int, remedy: str) -> _Model:
    """Read a YAML file into a record. Raises InputError like `parse_plain_yaml` and `validated`."""
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Cannot read the {what} file {path}: {error}. {remedy}") from None
    content = parse_plain_yaml(text, str(path), what, max_bytes, remedy)
    return validated(model, content, f"{path} is not a valid {what} file", remedy)


def printable(text: str) -> str:
    """Return the text. Raises ValueError for control characters but line ends: terminals and pages show it."""
    strange = sorted({c for c in text if not (c.isprintable() or c == "\n")})
    if strange:
        raise ValueError(
            f"has characters that cannot be printed: {', '.join(map(ascii, strange[:8]))}. Remove them."
        )
    return text


def _no_boolean(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be a number, not true or false")
    return value


Number = Annotated[float, BeforeValidator(_no_boolean)]
"""A number in a file: pydantic alone would read true as 1."""


def explain_faults(error: ValidationError, remedies: Mapping[str, str] | None = None) -> str:
    """Return one line per fault: the field, the error, the remedy. `remedies` by pydantic's type of fault."""
    known = {**_REMEDIES, **(remedies or {})}
    lines = []
    for fault in error.errors(include_input=False, include_url=False)[:8]:
        where = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in fault["loc"]).lstrip(".")
        where = where if len(where) <= 120 else f"{where[:120]}..."
        remedy = known.get(fault["type"]) or str(fault["msg"]).removeprefix("Value error, ")
        lines.append(f"  {where or 'file'}: {remedy}")
    return "\n".join(lines)
