"""What the fields of a problem may hold in a file; errors name the field and the remedy."""

import difflib
import math
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field

from torc.io.strict_yaml import Number, printable
from torc.objects.library import has_object, object_names
from torc.objects.models import Quat, Vec3
from torc.objects.schema import NAME_PATTERN, Name
from torc.records.camera import MAX_OBJECTS
from torc.workspace.workspace_files import load_workspace

Category = Literal["structured", "unstructured"]
Scalar = str | int | float | bool
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
_MAX_NUMBER, _MAX_ORIGIN = 2**63, 100
_Object = TypeVar("_Object")
REMEDIES = {
    "too_long": f"holds too many entries; at most {MAX_OBJECTS} objects, 3 numbers a position, 4 a rotation, "
    f"{_MAX_ORIGIN} facts of origin"
}
BELOW_TABLE_M, ABOVE_TABLE_M = 0.02, 1.0
"""Limits of the height of an object's origin, below and above the table top, metres."""


def _known(model: str) -> str:
    if has_object(model):
        return model
    valid = object_names()
    near = difflib.get_close_matches(model, valid, n=1)
    hint = f" did you mean '{near[0]}'?" if near else ""
    raise ValueError(
        f"there is no object model '{model}' on this machine;{hint} `torc objects list` shows all {len(valid)}. "
        f"If it is somebody's own, import its mesh (`torc objects import MESH --name {model}`) or add the directory "
        "that holds it to TORC_OBJECTS."
    )


def _over_the_table(position: Vec3) -> Vec3:
    workspace = load_workspace()
    center, half = np.array(workspace.table.center), np.array(workspace.table.size) / 2
    lower, upper = center - half, center + half
    lower[2], upper[2] = workspace.support_z_m - BELOW_TABLE_M, workspace.support_z_m + ABOVE_TABLE_M
    if not (np.all(position >= lower - 1e-9) and np.all(position <= upper + 1e-9)):
        raise ValueError(
            f"{list(position)} is not over the table: the origin must lie between {lower.round(3).tolist()} "
            f"and {upper.round(3).tolist()} (world frame, metres)."
        )
    return position


def _unit(wxyz: Quat) -> Quat:
    norm = math.hypot(*wxyz)
    if not 1e-6 < norm < 1e6:
        raise ValueError("a rotation must not be zero or huge; [1, 0, 0, 0] is upright (order w, x, y, z).")
    if abs(norm - 1.0) < 1e-9:  # unchanged, so that a loaded file is saved unchanged
        return wxyz
    w, x, y, z = (v / norm for v in wxyz)
    return w, x, y, z


def _small(origin: dict[str, Scalar]) -> dict[str, Scalar]:
    for value in origin.values():
        if isinstance(value, str):
            printable(value)
        elif abs(value) > _MAX_NUMBER:
            raise ValueError("holds a number that is too large; put it in quotes.")
    return origin


def _distinct(objects: tuple[Any, ...]) -> tuple[Any, ...]:
    if not objects:  # not by min_length, which pydantic also finds broken if every object is wrong
        raise ValueError("holds too few entries")
    names = [o.name for o in objects]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"names must be unique; more than once: {', '.join(twice)}. Rename all but one.")
    return objects


Text = Annotated[str, Field(max_length=2000), AfterValidator(printable)]
Model = Annotated[Name, AfterValidator(_known)]
TargetModel = Annotated[
    str,
    Field(pattern=rf"^$|{NAME_PATTERN}"),
    AfterValidator(lambda model: model and _known(model)),
]
Position = Annotated[tuple[Number, Number, Number], AfterValidator(_over_the_table)]
Rotation = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit)]
Origin = Annotated[dict[Text, Scalar], Field(max_length=_MAX_ORIGIN), AfterValidator(_small)]
WorkspaceName = Annotated[str, Field(pattern=r"^(\w[\w .+-]{0,63})?$")]
Objects = Annotated[tuple[_Object, ...], Field(max_length=MAX_OBJECTS), AfterValidator(_distinct)]
