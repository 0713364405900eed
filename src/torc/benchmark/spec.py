"""The plan of a benchmark: every planner on every problem with every seed. On disk it is spec.json of a store.

Everything is checked here before the first trial, so that faults are reported at once and stop nothing later.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import product
from typing import Any

from torc.errors import InputError
from torc.io.digests import file_fingerprint, fingerprint, part_source
from torc.objects.library import find_stored, object_facts
from torc.pipeline.building import build_system, sources
from torc.pipeline.planners import load_planner, make_spec_planner
from torc.problems.problem import Problem, load_problem
from torc.problems.sets import select_problems, shipped_path
from torc.registry.context import parameters
from torc.registry.kinds import TASK_PLANNERS
from torc.registry.loading import blamed, is_shipped, part_paths
from torc.registry.settings import Settings
from torc.specs.conditions import Conditions, varied
from torc.specs.trial import PlannerSpec, TrialSpec, settings_text
from torc.vlm.cache import CacheConfig
from torc.vlm.config import DEFAULT_QUESTIONS, VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.simulated.profiles import find_profile
from torc.vlm.simulated.situation import Situation

ID_FORMAT = "torc-bench-trial/2"
_OWN_OBJECT_FILES = ("object.yaml", "geometry.npz", "texture_*.png")
_REMEDY = "Repair it, or leave it out."


@dataclass(frozen=True)
class BenchProblem:
    """A problem of a benchmark; its name is unique in the store. `digest` is its `problem_fingerprint`.

    `shipped`: it comes with torc; otherwise the store's copy is played.
    """

    name: str
    category: str
    digest: str
    shipped: bool


@dataclass(frozen=True)
class BenchPlanner:
    """A task planner of a benchmark, under the benchmark's conditions or a variant of them.

    `source` is the fingerprint of the file that defines it, "" if it comes with torc. `variant` holds changes to the
    conditions, by field or dotted path of a setting, `variant_sources` fingerprints of user-defined parts under it.
    """

    spec: PlannerSpec
    source: str = ""
    variant: Settings = field(default_factory=dict)
    variant_sources: Mapping[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Its name in tables."""
        return self.spec.label + (f" {{{settings_text(self.variant)}}}" if self.variant else "")


@dataclass(frozen=True)
class Around:
    """The shared conditions of a store, which make its trials comparable, and user-defined parts' fingerprints."""

    conditions: Conditions = field(default_factory=Conditions)
    sources: Mapping[str, str] = field(default_factory=dict)

    @property
    def facts(self) -> dict[str, Any]:
        return self.conditions.facts(self.sources)

    def under(self, planner: BenchPlanner) -> "Around":
        """Return what applies to a planner, given its variant."""
        variant = planner.variant
        return Around(varied(self.conditions, variant), planner.variant_sources) if variant else self


@dataclass(frozen=True)
class PlannedTrial:
    """One trial of a benchmark: everything that decides its result. `around` includes the planner's variant.

    The id follows from everything that decides the result (torc's version too), and from nothing else.
    """

    problem: BenchProblem
    planner: BenchPlanner
    seed: int
    around: Around
    version: str
    id: str

    @property
    def cell(self) -> tuple[str, str, int]:
        return self.planner.label, self.problem.name, self.seed

    @property
    def directory_name(self) -> str:
        """Name of its directory: readable, then unique."""
        planner = re.sub(r"[^\w.]+", "-", self.planner.label).strip("-")[:80]
        return f"{self.problem.name}-{planner}-{self.seed}-{self.id[:10]}"

    @property
    def sources(self) -> dict[str, str]:
        """Fingerprints of user-defined parts, by field; the planner's as "planner"."""
        own = {"planner": self.planner.source} if self.planner.source else {}
        return {**self.around.sources, **own}

    def spec(self, problem: str) -> TrialSpec:
        """Return the spec for `run_trial`; `problem` is the name or path of the problem."""
        return TrialSpec(problem, self.planner.spec, self.seed, self.around.conditions)


@dataclass(frozen=True)
class BenchSpec:
    """The trials of a store, in the order in which they are played; no two in the same cell."""

    around: Around
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
    around: Around,
    version: str,
) -> BenchSpec:
    """Plan every planner on every problem with every seed: seed by seed, so that an unfinished benchmark is balanced.

    Raises InputError: nothing to play, or two planners of one name.
    """
    labels = Counter(p.label for p in planners)
    if twice := [label for label, count in labels.items() if count > 1]:
        raise InputError(f"More than one planner is called {', '.join(twice)}. Give each its own `name`.")
    every = product(seeds, problems, planners)
    trials = tuple(planned(problem, who, seed, around, version) for seed, problem, who in every)
    if not trials:
        raise InputError("There is nothing to play: name at least one problem, planner and repeat.")
    return BenchSpec(around, trials)


def planned(
    problem: BenchProblem, planner: BenchPlanner, seed: int, around: Around, version: str
) -> PlannedTrial:
    """Return a trial with its id; `around` is the benchmark's, without the planner's variant."""
    here, spec = around.under(planner), planner.spec
    who = {"name": spec.name, "vlm": vlm_facts(spec.vlm), "settings": dict(spec.settings)}
    facts = {
        "format": ID_FORMAT,
        "torc": version,
        "problem": {"name": problem.name, "digest": problem.digest},
        "planner": who | {"source": planner.source},
        "seed": seed,
        "around": here.facts,
    }
    return PlannedTrial(problem, planner, seed, here, version, fingerprint(facts))


def merged(old: BenchSpec, new: BenchSpec) -> BenchSpec:
    """Merge specs: a new trial replaces an old one of its cell, other old ones are kept.

    Raises InputError: the conditions or problems differ, so that the results could not be compared.
    """
    before, now = old.around.facts, new.around.facts
    if before != now:
        differ = sorted(k for k in before | now if before.get(k) != now.get(k))
        told = ", ".join(_difference(k, old.around.conditions, new.around.conditions) for k in differ)
        raise InputError(
            f"The trials there were played under other conditions ({told}), and cannot be compared with these. "
            "Use the same ones, another --out, or --sweep to compare them."
        )
    digests = {p.name: p.digest for p in old.problems}
    changed = [p.name for p in new.problems if digests.get(p.name, p.digest) != p.digest]
    if changed:
        raise InputError(
            f"There are trials there of problems that have changed since: {', '.join(changed)}. Use another --out."
        )
    # The user's files may lie elsewhere now.
    kept = (replace(t, around=new.around.under(t.planner)) for t in old.trials)
    return BenchSpec(new.around, tuple({t.cell: t for t in (*kept, *new.trials)}.values()))


def _difference(name: str, old: Conditions, new: Conditions) -> str:
    there, now = (c.settings.get(name, getattr(c, name, "default")) for c in (old, new))
    return f"{name} {there} there, {now} now" if there != now else f"{name} {now}, which has changed since"


def shard_of(spec: BenchSpec, shard: str) -> BenchSpec:
    """Return a shard such as "3/20": every 20th trial, beginning with the third. Raises InputError if it is empty."""
    found = re.fullmatch(r"(\d+)/(\d+)", shard)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--shard takes I/N with I from 1 to N, e.g. 3/20, not '{shard}'.")
    trials = spec.trials[int(found[1]) - 1 :: int(found[2])]
    if not trials:
        raise InputError(f"--shard {shard} holds none of the {len(spec.trials)} trials: take fewer shards.")
    return replace(spec, trials=trials)


def problem_fingerprint(problem: Problem) -> str:
    """Return the fingerprint of what can change a trial: objects in their order, target, description.

    torc's version covers models that come with it; user-defined models count with their files.
    """
    own = {o.model for o in problem.ordered() if not object_facts(o.model).builtin}
    objects = [
        [o.name, o.model, *([float(v) for v in vector] for vector in (o.position, o.wxyz))]
        for o in problem.objects
    ]
    facts: dict[str, Any] = {"description": problem.description, "target": problem.target, "objects": objects}
    if problem.absent:
        facts["target_model"] = problem.target_model
    if problem.workspace:
        facts["workspace"] = problem.workspace
    return fingerprint(facts | {"models": {name: _own_object(name) for name in sorted(own)}})


def vlm_facts(vlm: VlmConfig | None) -> dict[str, Any] | None:
    """Return the facts about a VLM that can change its replies. Time-outs and retries cannot."""
    if vlm is None:
        return None
    names = ("provider", "url", "model", "thinking", "max_output_tokens", "seeded", "structured")
    facts = {name: getattr(vlm, name) for name in names}
    facts["temperature"] = None if vlm.temperature is None else float(vlm.temperature)
    # Only if they are set: trials that were played before these settings existed keep their ids.
    if vlm.picture != PictureConfig():
        facts["picture"] = asdict(vlm.picture)
    if vlm.questions != DEFAULT_QUESTIONS:
        facts["questions"] = vlm.questions
    if vlm.prompt is not None:
        facts["prompt"] = vlm.prompt.digest
    return facts | ({"simulated": asdict(find_profile(vlm.model))} if vlm.simulated else {})


def _own_object(name: str) -> list[str]:
    directory = find_stored(name)
    if directory is None:
        return []
    files = (file for pattern in _OWN_OBJECT_FILES for file in sorted(directory.glob(pattern)))
    return [file_fingerprint(file) for file in files if file.is_file()]


def find_problems(selection: str) -> dict[BenchProblem, Problem]:
    """Return the problems that a user selected, in order. Raises InputError, also if two have the same name."""
    found: dict[BenchProblem, Problem] = {}
    files: dict[str, str] = {}
    for name in select_problems(selection):
        problem = load_problem(name)
        first = files.setdefault(problem.name, name)
        if first != name:
            raise InputError(
                f"{first} and {name} are both called '{problem.name}', so their trials would be mixed up. Change "
                "`name:` in one of the files, or leave it out; generated ones are called otherwise with another --seed."
            )
        shipped = shipped_path(name) is not None
        found[BenchProblem(problem.name, problem.category, problem_fingerprint(problem), shipped)] = problem
    return found


def split_vlm(text: str) -> tuple[str, str | None]:
    """Split "vlm-select:simulated:0.9" into a planner's name and the VLM that the user named behind it."""
    name, colon, vlm = text.partition(":")
    return (name, vlm) if colon and name in part_paths(TASK_PLANNERS) else (text, None)


def find_around(conditions: Conditions) -> Around:
    """Return the conditions with fingerprints of user-defined parts. Raises InputError if a part cannot be used."""
    with blamed("The parts around the planners", InputError, _REMEDY):
        build_system(conditions)
        return Around(conditions, sources(conditions))


def find_planner(spec: PlannerSpec, vlm_cache: CacheConfig | None, own_vlm: bool) -> BenchPlanner:
    """Check a planner by making it once; the VLM is passed to it if it takes a `client`.

    `own_vlm`: the VLM was named for this planner alone, so that it must ask one. Raises InputError: it is unknown, or
    cannot be made (no key, missing options).
    """
    name = spec.name
    with blamed(f"The planner '{name}'", InputError, _REMEDY):
        maker = load_planner(name)
        vlm = spec.vlm if "client" in parameters(maker) else None
        if vlm is None and TASK_PLANNERS.traits(maker).asks_model:
            raise InputError(
                f"The planner '{name}' asks a model: name it with --vlm, e.g. --vlm gemini:MODEL."
            )
        if vlm is None and own_vlm:
            raise InputError(f"The planner '{name}' asks no model: write '{name}' alone.")
        spec = replace(spec, vlm=vlm)
        truth = _not_asked if vlm is not None and vlm.simulated else None
        make_spec_planner(spec, vlm_cache if vlm else None, truth)
        return BenchPlanner(spec, "" if is_shipped(TASK_PLANNERS, name) else part_source(maker))


def under_variants(
    planners: Sequence[BenchPlanner], conditions: Conditions, variants: Sequence[Settings]
) -> list[BenchPlanner]:
    """Return every planner under every variant of the conditions; an empty one changes nothing. Raises InputError."""
    found = []
    for variant in variants:
        own = find_around(varied(conditions, variant)).sources if variant else {}
        found += [replace(p, variant=variant, variant_sources=own) for p in planners]
    return found


def _not_asked() -> Situation:
    """Stand in for a trial's truth while a simulated VLM is only made."""
    raise InputError("There is no trial yet to tell the truth of.")
