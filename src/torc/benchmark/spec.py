"""What is played: every planner on every problem with every seed. Frozen, and on disk as spec.json of a store."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

from torc.benchmark.identity import ID_FORMAT, vlm_facts
from torc.errors import InputError
from torc.fingerprints import fingerprint
from torc.grasping.names import DEFAULT_GRASPS
from torc.pipeline.min_score import DEFAULT_MIN_SCORE
from torc.robots.names import DEFAULT_ROBOT
from torc.vlm.config import VlmConfig

SPEC_FORMAT = "torc-bench/1"


@dataclass(frozen=True)
class Settings:
    """What all trials of a store share, so that they can be compared.

    Attributes:
        max_picks: attempts, failed ones included.
        noise: add sensor noise.
        robot: name or file of the robot description.
        min_score: less likely grasps wait until there are no better ones.
        grasps: name of the grasp planner, or module:Class.
        robot_source, grasps_source: fingerprints of what does not come with torc; "" else.
    """

    max_picks: int = 15
    noise: bool = False
    robot: str = DEFAULT_ROBOT
    min_score: float = DEFAULT_MIN_SCORE
    grasps: str = DEFAULT_GRASPS
    robot_source: str = ""
    grasps_source: str = ""

    def __post_init__(self) -> None:
        if self.max_picks < 1:
            raise InputError("--max-picks must be at least 1.")
        if not 0.0 <= self.min_score <= 1.0:
            raise InputError(f"--min-score {self.min_score} is no probability; give 0 to 1.")
        object.__setattr__(self, "min_score", float(self.min_score))

    def facts(self) -> dict[str, Any]:
        """What of them decides results: of a robot of one's own what is in its files, wherever they lie."""
        facts = {
            "max_picks": self.max_picks,
            "noise": self.noise,
            "robot": self.robot_source or self.robot,
            "min_score": self.min_score,
        }
        if self.grasps == DEFAULT_GRASPS:
            return facts
        return facts | {"grasps": self.grasps, "grasps_source": self.grasps_source}


@dataclass(frozen=True)
class BenchProblem:
    """A problem of a benchmark.

    Attributes:
        name: unique in the store; the trials of one problem are not independent of each other.
        category: structured or unstructured.
        digest: see `problem_fingerprint`.
        shipped: it comes with torc; else the store's copy is played.
    """

    name: str
    category: str
    digest: str
    shipped: bool


SIMULATED = "simulated "
"""In a label, before the profile of a simulated VLM."""


@dataclass(frozen=True)
class BenchPlanner:
    """A task planner of a benchmark.

    Attributes:
        name: in the registry, or module:Class.
        vlm: the model that it asks, for those that ask one.
        source: fingerprint of the file that defines it, for planners that do not come with torc; "" else.
    """

    name: str
    vlm: VlmConfig | None = None
    source: str = ""

    @property
    def label(self) -> str:
        """How it is called in tables."""
        if self.vlm is None:
            return self.name
        return f"{self.name}[{SIMULATED if self.vlm.simulated else ''}{self.vlm.model}]"


@dataclass(frozen=True)
class PlannedTrial:
    """One trial of a benchmark: everything that decides its result.

    Attributes:
        problem, planner, seed, settings: what is played.
        version: torc's.
    """

    problem: BenchProblem
    planner: BenchPlanner
    seed: int
    settings: Settings
    version: str

    @cached_property
    def id(self) -> str:
        """64 hexadecimal digits that follow from all that decides the result."""
        return fingerprint(
            {
                "format": ID_FORMAT,
                "torc": self.version,
                "problem": {"name": self.problem.name, "digest": self.problem.digest},
                "planner": {
                    "name": self.planner.name,
                    "vlm": vlm_facts(self.planner.vlm),
                    "source": self.planner.source,
                },
                "seed": self.seed,
                "settings": self.settings.facts(),
            }
        )

    @property
    def cell(self) -> tuple[str, str, int]:
        """Its place in the table: planner, problem, seed."""
        return self.planner.label, self.problem.name, self.seed

    @property
    def directory_name(self) -> str:
        """Name of its directory: for people first, then for certain."""
        planner = re.sub(r"[^\w.]+", "-", self.planner.label).strip("-")[:80]
        return f"{self.problem.name}-{planner}-{self.seed}-{self.id[:10]}"


@dataclass(frozen=True)
class BenchSpec:
    """The trials of a store, in the order in which they are played.

    Attributes:
        settings: shared by all.
        trials: no two in the same cell.
    """

    settings: Settings
    trials: tuple[PlannedTrial, ...] = field(repr=False)

    @property
    def planners(self) -> tuple[BenchPlanner, ...]:
        """Distinct planners by label, in order of appearance; the latest of that label."""
        return tuple({t.planner.label: t.planner for t in self.trials}.values())

    @property
    def problems(self) -> tuple[BenchProblem, ...]:
        """Distinct problems, in order of appearance."""
        return tuple({t.problem.name: t.problem for t in self.trials}.values())


def make_spec(
    problems: Sequence[BenchProblem],
    planners: Sequence[BenchPlanner],
    seeds: Sequence[int],
    settings: Settings,
    version: str,
) -> BenchSpec:
    """Every planner on every problem with every seed: seed by seed, so that an unfinished benchmark is balanced.

    Raises:
        InputError: two problems or planners have the same name, or there is nothing to play.
    """
    _distinct("problem", [p.name for p in problems])
    _distinct("planner", [p.label for p in planners])
    trials = tuple(
        PlannedTrial(problem, planner, seed, settings, version)
        for seed in seeds
        for problem in problems
        for planner in planners
    )
    if not trials:
        raise InputError(
            "There is nothing to play: name at least one problem and one planner, and one repeat."
        )
    return BenchSpec(settings, trials)


def merged(old: BenchSpec, new: BenchSpec) -> BenchSpec:
    """Both: a new trial takes the place of an old one of its cell, other old ones stay.

    Raises:
        InputError: the settings or problems differ, so that the results could not be compared.
    """
    before, now = old.settings.facts(), new.settings.facts()
    if before != now:
        differ = dict.fromkeys(k.removesuffix("_source") for k in before | now if before.get(k) != now.get(k))
        told = ", ".join(_difference(k, old.settings, new.settings) for k in differ)
        raise InputError(
            f"The trials there were played with other settings ({told}), and cannot be compared with these. "
            "Use the same settings or another --out."
        )
    digests = {p.name: p.digest for p in old.problems}
    changed = [p.name for p in new.problems if digests.get(p.name, p.digest) != p.digest]
    if changed:
        raise InputError(
            f"There are trials there of problems that have changed since: {', '.join(changed)}. Use another --out."
        )
    # A robot's files may lie elsewhere now.
    kept = (replace(t, settings=new.settings) for t in old.trials)
    cells = {t.cell: t for t in (*kept, *new.trials)}
    return BenchSpec(new.settings, tuple(cells.values()))


def _difference(name: str, old: Settings, new: Settings) -> str:
    there, now = getattr(old, name), getattr(new, name)
    return f"{name} {there} there, {now} now" if there != now else f"{name} {now}, which has changed since"


def to_json(spec: BenchSpec) -> dict[str, Any]:
    """Plain data; `from_json` gives back an equal spec."""
    # Trials of the same label may differ in source or version: each combination is written once.
    parts: dict[str, list[dict[str, Any]]] = {"problems": [], "planners": []}
    trials = []
    for trial in spec.trials:
        problem = _index(parts["problems"], asdict(trial.problem))
        planner = _index(parts["planners"], asdict(trial.planner))
        trials.append(
            {
                "id": trial.id,
                "problem": problem,
                "planner": planner,
                "seed": trial.seed,
                "torc": trial.version,
                "directory": trial.directory_name,
            }
        )
    return {"format": SPEC_FORMAT, "settings": asdict(spec.settings), **parts, "trials": trials}


def from_json(data: Mapping[str, Any], source: str) -> BenchSpec:
    """A spec from plain data; `source` names it in errors. Raises InputError."""
    if not isinstance(data, Mapping) or data.get("format") != SPEC_FORMAT:
        found = data.get("format") if isinstance(data, Mapping) else None
        raise InputError(
            f"{source} is of format {found!r}; this torc reads {SPEC_FORMAT!r}. A newer torc may have written it."
        )
    try:
        settings = Settings(**data["settings"])
        problems = [BenchProblem(**p) for p in data["problems"]]
        planners = [
            BenchPlanner(p["name"], VlmConfig(**p["vlm"]) if p["vlm"] else None, p["source"])
            for p in data["planners"]
        ]
        trials = tuple(
            PlannedTrial(
                problems[t["problem"]], planners[t["planner"]], int(t["seed"]), settings, str(t["torc"])
            )
            for t in data["trials"]
        )
        wrong = next((t["id"] for t, made in zip(data["trials"], trials) if t["id"] != made.id), None)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"{source} is damaged ({type(error).__name__}: {error}). Use another --out."
        ) from None
    if wrong is not None:
        raise InputError(f"{source} was changed by hand: trial {wrong[:10]} is not what its id says.")
    return BenchSpec(settings, trials)


def _index(entries: list[dict[str, Any]], entry: dict[str, Any]) -> int:
    if entry not in entries:
        entries.append(entry)
    return entries.index(entry)


def _distinct(what: str, names: Sequence[str]) -> None:
    twice = sorted(_twice(names))
    if twice:
        raise InputError(f"More than one {what} is called {', '.join(twice)}. Names must differ.")


def _twice(names: Sequence[str]) -> Iterator[str]:
    return (name for name in set(names) if names.count(name) > 1)
