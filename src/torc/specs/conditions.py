"""Everything around the task planner: what trials must share to be compared, and variants of it to compare with each
other: "occlusion.smooth_px=0,3".
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product
from pathlib import Path
from typing import Any

import yaml

from torc.errors import InputError, UnknownNameError
from torc.io.numbers import plain_values, take_numbers
from torc.registry.kinds import CONFIGURED, STAGES
from torc.registry.loading import short_part_name
from torc.registry.settings import Settings
from torc.robots.names import DEFAULT_ROBOT

DEFAULT_MIN_SCORE = 0.25
"""At .25 three of four tries fail, and leave the object further away or lying down."""
DEFAULT_WORKSPACE = "paper"
_DIGITS = 8


@dataclass(frozen=True)
class PipelineSpec:
    """The stages between camera and task planner. They have settings: --STAGE.SETTING VALUE, e.g.
    --occlusion.smooth-px 3; `torc settings` lists them.
    """

    depth: str = "as-measured"
    """Depth: where the depth image comes from."""
    perception: str = "labels"
    """Perception: what finds the objects."""
    grasps: str = "geometric"
    """Grasp planner."""
    min_score: float = DEFAULT_MIN_SCORE
    """Grasps that are less likely to deliver wait until no object has a better one; 0 keeps to the paper."""
    settings: Settings = field(default_factory=dict)
    """Settings of the stages, by dotted path ({"occlusion.smooth_px": 3}); on the command line
    --occlusion.smooth-px 3."""

    def __post_init__(self) -> None:
        take_numbers(self)
        if not 0.0 <= self.min_score <= 1.0:
            raise InputError(f"--min-score {self.min_score} is no probability, from 0 to 1.")
        object.__setattr__(self, "min_score", float(self.min_score))
        stages = [*(f.name for f in fields(self) if f.name in STAGES), *CONFIGURED]
        for path in self.settings:
            stage, dot, _ = path.partition(".")
            if stage == "planner":
                raise InputError(
                    f"The setting '{path}' is the planner's, not one of the conditions: pass a planner that is made "
                    "with it, e.g. MyPlanner(power=2), or PlannerSpec(name, settings={...})."
                )
            if stage not in stages or not dot:
                raise UnknownNameError("stage in the setting", path, [f"{s}." for s in stages])
        object.__setattr__(self, "settings", plain_values(dict(sorted(self.settings.items()))))


@dataclass(frozen=True)
class Conditions(PipelineSpec):
    """The stages around the task planner, and the budget.

    Stages have settings: --occlusion.smooth-px 3, or settings={"occlusion.smooth_px": 3} in Python. `torc settings`
    lists them.
    """

    camera: str = "simulated"
    """Camera. A simulated trial takes `simulated`, or your own that looks through it."""
    motion: str = "sampling"
    """Motion planner."""
    robot: str = DEFAULT_ROBOT
    """Robot: sda10f_2f85, ur5e_2f85, panda_hand, or a robot description file of your own (docs/robots.md)."""
    workspace: str = DEFAULT_WORKSPACE
    """Table, bin and camera pose: paper, or a workspace file of your own (docs/robots.md)."""
    noise: bool = False
    """Add the noise of a stereo camera: depth errors that grow with distance, lost edges, eroded masks."""
    friction: float = 1.0
    """Sliding friction of everything in the simulation, as a multiple; below 1 things slip more easily."""
    max_picks: int = 15
    """Attempts, failed ones included."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.1 <= self.friction <= 10:
            raise InputError(f"--friction {self.friction} is not between .1 and 10.")
        if self.max_picks < 1:
            raise InputError("--max-picks must be at least 1.")

    def at(self, workspace: str) -> "Conditions":
        """Return these conditions for a problem that names its workspace ("" if it names none).

        An explicitly chosen workspace is kept; `build_world` says if it is the wrong one.
        """
        wanted = workspace and self.workspace == DEFAULT_WORKSPACE
        return replace(self, workspace=workspace) if wanted else self

    def facts(self, sources: Mapping[str, str]) -> dict[str, Any]:
        """Return the differences from the defaults as plain data.

        `sources` are the fingerprints of user-defined parts by field (`torc.pipeline.building.sources`): these parts
        count by the content of their files.
        """
        changed = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "settings"}
        default = Conditions()
        facts = {k: sources.get(k) or v for k, v in changed.items() if v != getattr(default, k)}
        return facts | dict(self.settings)

    def text(self, sources: Mapping[str, str]) -> str:
        """Return differences from the defaults as text, without the budget. Trials with equal text can be compared."""
        told = {k: v for k, v in self.facts({}).items() if k != "max_picks"}
        return ", ".join(_told(name, value, sources.get(name, "")) for name, value in told.items())


def _told(name: str, value: Any, source: str) -> str:
    """Return one condition as text, with the beginning of its fingerprint if it is user-defined."""
    if value is True:
        return name
    if isinstance(value, float):
        return f"{name} {value:g}"
    shown = Path(value).stem if name in ("robot", "workspace") else short_part_name(str(value))
    return f"{name} {shown} ({source[:_DIGITS]})" if source else f"{name} {shown}"


def variants(sweeps: Sequence[str]) -> list[dict[str, Any]]:
    """Return every combination of the values in texts like "occlusion.smooth_px=0,3"; one empty variant without texts.

    Raises:
        InputError: a text has another form.
    """
    parsed = dict(_parsed(sweep) for sweep in sweeps)
    return [dict(zip(parsed, values)) for values in product(*parsed.values())]


def varied(conditions: Conditions, variant: Settings) -> Conditions:
    """Return the conditions with the changes of a variant. Raises UnknownNameError for an unknown field."""
    names = [f.name for f in fields(Conditions) if f.name != "settings"]
    settings = {k: v for k, v in variant.items() if "." in k}
    changes = {k: v for k, v in variant.items() if "." not in k}
    for name in changes:
        if name not in names:
            raise UnknownNameError("condition to compare", name, names)
    return replace(conditions, **changes, settings={**conditions.settings, **settings})


def plain_value(text: str) -> Any:
    """Read a text as YAML: a number, true, null, a list in brackets; otherwise return it unchanged.

    Digits after a 0, as in serial numbers, stay text: YAML would read them as octal.
    """
    if re.fullmatch(r"0[0-9_]+", text):
        return text
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return text


def _parsed(text: str) -> tuple[str, list[Any]]:
    name, equals, values = text.partition("=")
    found = plain_value(f"[{values}]") if equals else None
    if not name or not isinstance(found, list) or len(found) < 1:
        raise InputError(f"--sweep {text} names no values to compare: write e.g. occlusion.smooth_px=0,3.")
    return name.replace("-", "_"), found
