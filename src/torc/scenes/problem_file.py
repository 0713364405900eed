"""The file of a problem: its schema, plain YAML, and errors that name the field and the remedy."""

import difflib
from collections import Counter
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, field_validator

from torc.errors import InputError
from torc.records.camera import MAX_OBJECTS
from torc.scenes.library import object_names
from torc.scenes.models import Quat, Vec3
from torc.scenes.workspace import Workspace

FORMAT = "torc-problem/1"
MAX_BYTES = 1_000_000
Category = Literal["structured", "unstructured"]
Scalar = str | int | float | bool
BELOW_TABLE_M, ABOVE_TABLE_M = 0.02, 1.0
"""How far below and above the table top an object's origin may be."""


_Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.\-]{0,63}$")]


def _printable(text: str) -> str:
    """Text is shown in terminals and pages: no control characters."""
    strange = sorted({c for c in text if not (c.isprintable() or c == "\n")})
    if strange:
        raise ValueError(
            f"has characters that cannot be printed: {', '.join(map(ascii, strange))}. Remove them."
        )
    return text


_Text = Annotated[str, Field(max_length=2000), AfterValidator(_printable)]
_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


class _ObjectFile(BaseModel):
    model_config = _STRICT
    name: _Name
    model: str
    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    @field_validator("model")
    @classmethod
    def _known(cls, model: str) -> str:
        valid = object_names()
        if model not in valid:
            raise ValueError(_unknown_model(model, valid))
        return model

    @field_validator("position")
    @classmethod
    def _on_the_table(cls, position: Vec3) -> Vec3:
        lower, upper = _region()
        if not (np.all(position >= lower) and np.all(position <= upper)):
            raise ValueError(
                f"{list(position)} is not over the table: the origin must lie between {lower.round(3).tolist()} "
                f"and {upper.round(3).tolist()} (world frame, metres)."
            )
        return position

    @field_validator("wxyz")
    @classmethod
    def _unit(cls, wxyz: Quat) -> Quat:
        norm = float(np.linalg.norm(wxyz))
        if not 1e-6 < norm < 1e6:
            raise ValueError("a rotation must not be zero; [1, 0, 0, 0] is upright (order w, x, y, z).")
        if abs(norm - 1.0) < 1e-9:  # kept as it is, so that loading and saving give back the same file
            return wxyz
        w, x, y, z = (v / norm for v in wxyz)
        return w, x, y, z


class ProblemFile(BaseModel):
    model_config = _STRICT
    format: Literal["torc-problem/1"]
    name: _Name
    category: Category
    description: _Text = ""
    notes: _Text = ""
    origin: dict[str, Scalar] = Field(default_factory=dict)
    target: str
    objects: Annotated[list[_ObjectFile], Field(min_length=1, max_length=MAX_OBJECTS)]

    @field_validator("objects")
    @classmethod
    def _distinct(cls, objects: list[_ObjectFile]) -> list[_ObjectFile]:
        twice = [name for name, count in Counter(o.name for o in objects).items() if count > 1]
        if twice:
            raise ValueError(f"names must be unique; more than once: {', '.join(twice)}. Rename all but one.")
        return objects


def read_problem_file(text: str, source: str) -> ProblemFile:
    """The validated content of a problem file; `source` names it in errors. Raises InputError."""
    data = _parse_yaml(text, source)
    try:
        return ProblemFile.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{source} is not a valid problem ({FORMAT}):\n{_explain(error)}") from None


class _PlainLoader(yaml.SafeLoader):
    """SafeLoader without aliases (they can blow a small file up) and without repeated keys (one would be lost)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.YAMLError(
                f"line {mark.line + 1}: aliases (*name) are not supported; write the value out"
            )
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value if isinstance(key.value, str)]
        for key, count in Counter(keys).items():
            if count > 1:
                raise yaml.YAMLError(
                    f"line {node.start_mark.line + 1}: '{key}' is given {count} times; keep one"
                )
        return super().construct_mapping(node, deep)


def _parse_yaml(text: str, source: str) -> Any:
    if len(text.encode()) > MAX_BYTES:
        raise InputError(f"{source} is larger than {MAX_BYTES} bytes: that is not a problem file.")
    try:
        data = yaml.load(text, Loader=_PlainLoader)  # a SafeLoader: builds plain values only
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"{source} is not readable YAML: {error}. Compare with a shipped problem.") from None
    except RecursionError:
        raise InputError(f"{source} is nested too deeply to be a problem file.") from None
    if not isinstance(data, dict):
        raise InputError(f"{source} holds no problem: it must start with 'format: {FORMAT}'.")
    return data


def _explain(error: ValidationError) -> str:
    """One line per fault: the field, what is wrong, what to do."""
    lines = []
    for fault in error.errors(include_input=False, include_url=False)[:8]:
        where = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in fault["loc"]).lstrip(".")
        lines.append(f"  {where or 'file'}: {_remedy(fault)}")
    return "\n".join(lines)


_REMEDIES = {
    "missing": "is missing; add it",
    "extra_forbidden": "is not a field of this format; remove it or check its spelling",
    "finite_number": "must be a finite number",
    "string_type": "must be text; put it in quotes",
    "string_pattern_mismatch": "must be 1 to 64 letters, digits, '_', '-' or '.', starting with a letter or digit",
    "too_long": f"holds too many entries; at most {MAX_OBJECTS} objects, 3 numbers a position, 4 a rotation",
    "too_short": "holds too few entries",
}


def _remedy(fault: Any) -> str:
    if fault["type"] in _REMEDIES:
        return _REMEDIES[fault["type"]]
    return str(fault["msg"]).removeprefix("Value error, ")


def _unknown_model(model: str, valid: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(model, valid, n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    return f"there is no object model '{model}';{hint} `torc objects list` shows all {len(valid)}."


def _region() -> tuple[np.ndarray, np.ndarray]:
    """Where an object's origin may be: over the table."""
    workspace = Workspace()
    center, half = np.array(workspace.table.center), np.array(workspace.table.size) / 2
    lower, upper = center - half, center + half
    lower[2], upper[2] = workspace.support_z_m - BELOW_TABLE_M, workspace.support_z_m + ABOVE_TABLE_M
    return lower - 1e-9, upper + 1e-9
