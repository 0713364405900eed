"""The file of a problem: its schema, plain YAML, and errors that name the field and the remedy."""

import difflib
import math
from collections import Counter
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator

from torc.io.strict_yaml import Number, parse_yaml_as, printable
from torc.objects.library import has_object, object_names
from torc.objects.models import Quat, Vec3
from torc.records.camera import MAX_OBJECTS
from torc.workspace.workspace_files import load_workspace

FORMAT = "torc-problem/1"
MAX_BYTES = 64_000
"""Several times what the fullest problem needs: YAML's reader takes a minute for a megabyte."""
Category = Literal["structured", "unstructured"]
Scalar = str | int | float | bool
_MAX_NUMBER, _MAX_ORIGIN = 2**63, 100
_REMEDIES = {
    "too_long": f"holds too many entries; at most {MAX_OBJECTS} objects, 3 numbers a position, 4 a rotation, "
    f"{_MAX_ORIGIN} facts of origin"
}
BELOW_TABLE_M, ABOVE_TABLE_M = 0.02, 1.0
"""Limits of the height of an object's origin, below and above the table top, metres."""

_Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.\-]{0,63}$")]
_Text = Annotated[str, Field(max_length=2000), AfterValidator(printable)]
_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


class _ObjectFile(BaseModel):
    model_config = _STRICT
    name: _Name
    model: _Name
    position: tuple[Number, Number, Number]
    wxyz: tuple[Number, Number, Number, Number] = (1.0, 0.0, 0.0, 0.0)

    @field_validator("model")
    @classmethod
    def _known(cls, model: str) -> str:
        if not has_object(model):
            raise ValueError(_unknown_model(model, object_names()))
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
        norm = math.hypot(*wxyz)
        if not 1e-6 < norm < 1e6:
            raise ValueError(
                "a rotation must not be zero or huge; [1, 0, 0, 0] is upright (order w, x, y, z)."
            )
        if abs(norm - 1.0) < 1e-9:  # unchanged, so that a loaded file is saved unchanged
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
    origin: dict[_Text, Scalar] = Field(default_factory=dict, max_length=_MAX_ORIGIN)
    target: _Name
    target_model: _Name | Literal[""] = ""
    workspace: Annotated[str, Field(pattern=r"^(\w[\w .+-]{0,63})?$")] = ""
    objects: Annotated[list[_ObjectFile], Field(min_length=1, max_length=MAX_OBJECTS)]

    @field_validator("origin")
    @classmethod
    def _small(cls, origin: dict[str, Scalar]) -> dict[str, Scalar]:
        for value in origin.values():
            if isinstance(value, str):
                printable(value)
            elif abs(value) > _MAX_NUMBER:
                raise ValueError("holds a number that is too large; put it in quotes.")
        return origin

    @field_validator("target_model")
    @classmethod
    def _known(cls, model: str) -> str:
        if model and not has_object(model):
            raise ValueError(_unknown_model(model, object_names()))
        return model

    @field_validator("objects")
    @classmethod
    def _distinct(cls, objects: list[_ObjectFile]) -> list[_ObjectFile]:
        twice = [name for name, count in Counter(o.name for o in objects).items() if count > 1]
        if twice:
            raise ValueError(f"names must be unique; more than once: {', '.join(twice)}. Rename all but one.")
        return objects


def read_problem_file(text: str, source: str) -> ProblemFile:
    """Return the validated content of a problem file; `source` names it in errors. Raises InputError."""
    return parse_yaml_as(
        ProblemFile, text, source, "problem", MAX_BYTES, "Compare with a shipped problem.", _REMEDIES
    )


def _unknown_model(model: str, valid: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(model, valid, n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    return (
        f"there is no object model '{model}' on this machine;{hint} `torc objects list` shows all {len(valid)}. "
        f"If it is somebody's own, import its mesh (`torc objects import MESH --name {model}`) or add the directory "
        "that holds it to TORC_OBJECTS."
    )


def _region() -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner of the region over the table where an object's origin may be."""
    workspace = load_workspace()
    center, half = np.array(workspace.table.center), np.array(workspace.table.size) / 2
    lower, upper = center - half, center + half
    lower[2], upper[2] = workspace.support_z_m - BELOW_TABLE_M, workspace.support_z_m + ABOVE_TABLE_M
    return lower - 1e-9, upper + 1e-9
