"""One trial: a problem, a planner, a seed, and the conditions."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torc.errors import InputError
from torc.io.numbers import plain_values, take_numbers
from torc.registry.loading import short_part_name
from torc.registry.settings import Settings
from torc.specs.conditions import Conditions
from torc.vlm.config import VlmConfig

SIMULATED = "simulated "
"""Stands in a label before the profile of a simulated VLM."""


@dataclass(frozen=True)
class PlannerSpec:
    """A task planner by name, and what it is made with.

    Attributes:
        name: a registered name, "module:Class" or "path/to/file.py:Class".
        vlm: the model that it asks.
        settings: its settings by path, e.g. {"power": 2}.
        expert: the person's name, if a person decides.
        outside_view: the person may see the scene from outside while playing, and is therefore not ranked.
    """

    name: str
    vlm: VlmConfig | None = None
    settings: Settings = field(default_factory=dict)
    expert: str = ""
    outside_view: bool = False

    def __post_init__(self) -> None:
        take_numbers(self)
        object.__setattr__(self, "settings", plain_values(self.settings))

    @property
    def asking(self) -> str:
        """The planner's name, and the VLM that it asks."""
        return self.name if self.vlm is None else f"{self.name} asking {self.vlm.text}"

    @property
    def label(self) -> str:
        """The planner's name in tables."""
        label = self.name
        if self.vlm is not None:
            model = f"{SIMULATED if self.vlm.simulated else ''}{self.vlm.model}"
            label += f"[{', '.join((model, *self.vlm.words))}]"
        if self.settings:
            label += f" ({settings_text(self.settings)})"
        label += f" {self.expert}" if self.expert else ""
        return label + (" (outside view)" if self.outside_view else "")


@dataclass(frozen=True)
class TrialSpec:
    """Everything that decides a trial's result.

    Attributes:
        problem: name of a shipped problem, or path of a problem file.
        planner: who decides.
        seed: decides all random draws.
        conditions: the stages around the planner, and the budget.
    """

    problem: str
    planner: PlannerSpec
    seed: int = 0
    conditions: Conditions = field(default_factory=Conditions)

    def __post_init__(self) -> None:
        take_numbers(self)
        if self.seed < 0:
            raise InputError("--seed must be at least 0.")

    @classmethod
    def of(
        cls,
        problem: str,
        planner: str = "dg-select",
        seed: int = 0,
        *,
        vlm: VlmConfig | None = None,
        **conditions: Any,
    ) -> "TrialSpec":
        """Return a spec from its most used parts: TrialSpec.of("structured-04", "random", noise=True).

        `conditions` are fields of `Conditions`.
        """
        return cls(problem, PlannerSpec(planner, vlm), seed, Conditions(**conditions))

    @property
    def problem_name(self) -> str:
        """The problem's name, or that of its file."""
        return Path(self.problem).stem if self.problem.endswith((".yaml", ".yml")) else self.problem

    @property
    def default_name(self) -> str:
        """A name for the trial's directory."""
        who, around = self.planner, self.conditions
        default = Conditions()
        parts = [Path(self.problem).stem, short_part_name(who.name)]
        asked = () if who.vlm is None else (who.vlm.short_name, *who.vlm.words)
        parts += [re.sub(r"[^\w.]+", "-", word) for word in asked]
        parts += [who.expert] if who.expert else []
        for name in ("camera", "depth", "perception", "grasps", "motion", "robot", "workspace"):
            if (used := getattr(around, name)) != getattr(default, name):
                parts.append(Path(used).stem if name in ("robot", "workspace") else short_part_name(used))
        parts += ["outside"] if who.outside_view else []
        settings = settings_text({**around.settings, **who.settings})
        parts += [re.sub(r"[^\w.=]+", "-", settings)] if settings else []
        return "-".join([*parts, str(self.seed)])


def settings_text(settings: Settings) -> str:
    """Return settings on one line, each by the last part of its path."""
    shown = {k: short_part_name(v) if isinstance(v, str) else v for k, v in settings.items()}
    return ", ".join(f"{path.rpartition('.')[2]}={value}" for path, value in shown.items())
