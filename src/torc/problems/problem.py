"""Problems: which objects lie where, and which one is the target. YAML on disk, format `torc-problem/1`.

format: torc-problem/1 name: behind_the_milk
category: structured            # or unstructured
description: The mug stands behind a milk carton.
target: mug                     # one of the objects, or an absent one: then with its target_model
objects:
- name: mug                     # unique within the problem
  model: mug_red                # see `torc objects list`
  position: [0.72, -0.10, 1.0975]   # of the model's origin, world frame, metres
  wxyz: [1.0, 0.0, 0.0, 0.0]

The annotations of the records say what each field may hold; a file is checked by them.
"""

import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import yaml

from torc.errors import InputError, UnknownNameError
from torc.geometry.transforms import Pose, make_pose, rotation_from_wxyz
from torc.io.reading import read_text
from torc.io.strict_yaml import parse_plain_yaml, validated
from torc.objects.schema import Name
from torc.problems.schema import (
    REMEDIES,
    STRICT,
    Category,
    Model,
    Objects,
    Origin,
    Position,
    Rotation,
    TargetModel,
    Text,
    WorkspaceName,
)
from torc.problems.sets import is_problem_set, problem_names, shipped_path
from torc.robots.names import robot_names

FORMAT = "torc-problem/1"
MAX_BYTES = 64_000
"""Several times what the fullest problem needs: YAML's reader takes a minute for a megabyte."""
_REMEDY = "Compare with a shipped problem."
ROBOT_KEYS = NAME_KEY, SOURCE_KEY = "robot", "robot_source"
"""Keys of a problem's origin: the robot's name, and the fingerprint of its files if it is user-defined."""

_NOWHERE = (-60.0, -60.0, 40.0)
"""The place of an absent target, metres."""


@dataclass(frozen=True)
class ObjectPlacement:
    """One object of a problem: a model of the object library, and the pose of its frame in the world.

    Attributes:
        name: the object's name within the problem.
        model: its model.
        position: metres.
        wxyz: unit quaternion.
    """

    name: Name
    model: Model
    position: Position
    wxyz: Rotation = (1.0, 0.0, 0.0, 0.0)

    __pydantic_config__ = STRICT

    @cached_property
    def T_world_object(self) -> Pose:
        """Pose of the model frame in the world frame."""
        return make_pose(rotation_from_wxyz(self.wxyz), self.position)


@dataclass(frozen=True)
class Problem:
    """A retrieval problem: which objects lie where, and which one is the target.

    Attributes:
        name: name of the problem.
        category: "structured" (most objects in a natural pose) or "unstructured" (a pile).
        description: the target in words.
        target: name of the target among `objects`.
        objects: the placements: name, model, position in metres, orientation as wxyz.
        notes: for people.
        origin: where the problem comes from: generator, seed, source.
        target_model: the target's model, if it is not among `objects`: then planners should give up.
        workspace: the workspace that it needs; "" for any.
    """

    name: Name
    category: Category
    description: Text
    target: Name
    objects: Objects[ObjectPlacement]
    notes: Text = ""
    origin: Origin = field(default_factory=dict)
    target_model: TargetModel = ""
    workspace: WorkspaceName = ""

    __pydantic_config__ = STRICT

    @property
    def absent(self) -> bool:
        """True if the target is not on the table: it is only described, and of `target_model`."""
        return bool(self.target_model)

    def ordered(self) -> tuple[ObjectPlacement, ...]:
        """Return the placements by object id: the target first, then the others in file order.

        An absent target keeps its id, at a place far from the table.
        """
        ghost = ObjectPlacement(self.target, self.target_model, _NOWHERE, (1.0, 0.0, 0.0, 0.0))
        placements = (ghost, *self.objects) if self.absent else self.objects
        return tuple(sorted(placements, key=lambda o: o.name != self.target))


def load_problem(name_or_path: str | os.PathLike[str]) -> Problem:
    """Load a retrieval problem.

    Args:
        name_or_path: name of a shipped problem (`problem_names`), or path of a YAML file.

    Raises:
        InputError: there is no such problem, or the file is wrong; the message names file, field and remedy.
    """
    path = _find(name_or_path)
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {error}.") from None
    return parse_problem(text, str(path))


def parse_problem(text: str, source: str = "problem") -> Problem:
    """Read a problem from YAML text; `source` names it in errors. Raises InputError."""
    content = parse_plain_yaml(text, source, "problem", MAX_BYTES, _REMEDY)
    head = f"{source} is not a valid problem file"
    if content.pop("format", None) != FORMAT:
        raise InputError(f"{head}:\n  format: must be {FORMAT}\n{_REMEDY}")
    problem = validated(Problem, {"description": "", **content}, head, _REMEDY, REMEDIES)
    names = [o.name for o in problem.objects]
    if problem.absent and problem.target in names:
        raise InputError(
            f"{source}, target_model: it is for a target that is not there, but '{problem.target}' is one of the "
            "objects. Leave target_model out, or give the target another name."
        )
    if not problem.absent and problem.target not in names:
        raise InputError(
            f"{source}, target: {UnknownNameError('object', problem.target, names)} Use one of these names, or give "
            "the target_model of a target that is not there."
        )
    return problem


def problem_text(problem: Problem) -> str:
    """Return the YAML of a problem; `parse_problem` reads it back. Raises InputError if the problem is not valid."""
    keys = ("name", "category", "description", "notes", "origin", "target", "target_model", "workspace")
    data = {k: value for k in keys if (value := getattr(problem, k)) or k == "description"}
    objects = [
        {
            "name": o.name,
            "model": o.model,
            "position": [*map(float, o.position)],
            "wxyz": [*map(float, o.wxyz)],
        }
        for o in problem.objects
    ]
    text = yaml.safe_dump(
        {"format": FORMAT, **data, "objects": objects},
        sort_keys=False,
        default_flow_style=None,
        width=110,
        allow_unicode=True,
    )
    parse_problem(text, f"problem '{problem.name}'")
    return text


def save_problem(problem: Problem, path: str | os.PathLike[str]) -> None:
    """Write a problem; the file appears complete or not at all. Raises InputError if the problem is not valid."""
    path = Path(path)
    text = problem_text(problem)
    aside = path.with_name(f".{path.name}.tmp")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def _find(name_or_path: str | os.PathLike[str]) -> Path:
    path = Path(name_or_path)
    if os.path.isfile(path):  # unlike Path.is_file, False for names that no file can have
        return path
    name = str(path)
    if is_problem_set(name):
        raise InputError(
            f"{name} is a set of {len(problem_names(name))} problems: name one of them (torc problems list {name}), "
            f"or play all with torc bench --problems {name}."
        )
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        raise InputError(f"There is no problem file {path}. `torc problems list` shows the shipped problems.")
    shipped = shipped_path(name)
    if shipped is None:
        raise UnknownNameError("problem", name, list(problem_names()), lister="torc problems list")
    return shipped


def robot_wanted(problem: Problem) -> str:
    """Return the name of the robot that a problem was made for; "" if it is the default one or unknown."""
    name = str(problem.origin.get(NAME_KEY, ""))
    return name if SOURCE_KEY in problem.origin or name in robot_names() else ""


def robot_option(problem: Problem) -> str:
    """Return what --robot takes for a problem: a shipped robot's name, FILE for another, "" for the default one."""
    wanted = robot_wanted(problem)
    return "FILE" if wanted and SOURCE_KEY in problem.origin else wanted


def robot_hint(problem: Problem, name: str, source: str) -> str:
    """Return a hint for a problem made for another robot than the one of this name and fingerprint; "" if it fits."""
    wanted = robot_wanted(problem)
    if not wanted or problem.origin.get(SOURCE_KEY, source if wanted == name else "") == source:
        return ""
    if wanted == name:
        return f"Made for the robot '{wanted}' before its files were changed: things may be out of reach."
    option = robot_option(problem)
    remedy = "give its file with --robot" if option == "FILE" else f"--robot {option}"
    return f"Made for the robot '{wanted}': {remedy}. For another one things may be out of reach."
