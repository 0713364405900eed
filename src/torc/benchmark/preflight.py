"""Check everything before the first trial, so that faults are reported at once and stop nothing later."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from torc.benchmark.spec import Around, BenchPlanner, BenchProblem, problem_fingerprint
from torc.errors import InputError, TorcError
from torc.io.digests import part_source
from torc.pipeline.building import build_system, sources
from torc.pipeline.planners import load_planner, make_spec_planner
from torc.problems.problem import Problem, load_problem
from torc.problems.sets import select_problems, shipped_path
from torc.registry.context import parameters
from torc.registry.kinds import TASK_PLANNERS
from torc.registry.loading import is_shipped, part_paths
from torc.registry.settings import Settings
from torc.specs.conditions import Conditions, varied
from torc.specs.trial import PlannerSpec
from torc.vlm.cache import CacheConfig
from torc.vlm.simulated.situation import Situation


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
        played = BenchProblem(
            name=problem.name,
            category=problem.category,
            digest=problem_fingerprint(problem),
            shipped=shipped_path(name) is not None,
        )
        found[played] = problem
    return found


def split_vlm(text: str) -> tuple[str, str | None]:
    """Split "vlm-select:simulated:0.9" into a planner's name and the VLM that the user named behind it."""
    name, colon, vlm = text.partition(":")
    return (name, vlm) if colon and name in part_paths(TASK_PLANNERS) else (text, None)


def find_around(conditions: Conditions) -> Around:
    """Return the conditions with fingerprints of user-defined parts. Raises InputError if a part cannot be used."""
    with _explained("The parts around the planners"):
        build_system(conditions)
        return Around(conditions, sources(conditions))


def find_planner(spec: PlannerSpec, vlm_cache: CacheConfig | None, own_vlm: bool) -> BenchPlanner:
    """Check a planner by making it once; the VLM is passed to it if it takes a `client`.

    Args:
        spec: the planner, its settings, and the VLM.
        vlm_cache: where replies are kept.
        own_vlm: the VLM was named for this planner alone, so that it must ask one.

    Raises:
        InputError: it is unknown, or cannot be made (no key, missing options).
    """
    name = spec.name
    with _explained(f"The planner '{name}'"):
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


@contextmanager
def _explained(what: str) -> Iterator[None]:
    """Turn any exception of user-defined parts into InputError."""
    try:
        yield
    except TorcError:
        raise
    except Exception as error:
        raise InputError(f"{what} cannot be made: {type(error).__name__}: {error}") from error


def _not_asked() -> Situation:
    """Stand in for a trial's truth while a simulated VLM is only made."""
    raise InputError("There is no trial yet to tell the truth of.")
