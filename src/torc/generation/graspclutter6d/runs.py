"""Importing many scenes: which problems are asked for, one attempt at each, and what came of it."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from torc.errors import InputError
from torc.generation.graspclutter6d.annotations import AnnotatedScene, read_scene, same_annotation
from torc.generation.graspclutter6d.layout import check_root, image_id, object_stem
from torc.generation.graspclutter6d.objects import check_meshes
from torc.generation.graspclutter6d.placement import placement_rule
from torc.generation.graspclutter6d.problems import BY_USER, how_imported, make_problem, problem_name
from torc.generation.graspclutter6d.published import PaperProblem, paper_problems, parse_object_name
from torc.generation.graspclutter6d.settling import (
    ImportConfig,
    Say,
    SceneFailure,
    SettledScene,
    settle_scene,
)
from torc.generation.graspclutter6d.targets import choose_target, find_target
from torc.generation.inspection import Inspector, SceneView, robot_facts
from torc.problems.made_for import ROBOT_KEYS
from torc.problems.problem import Problem, load_problem, save_problem
from torc.problems.schema import Category

_TARGET_BY, _BY_RULE = "target_by", "torc"


@dataclass(frozen=True)
class ImportRequest:
    """What to import.

    Attributes:
        root: of the data set.
        scenes: numbers; with `paper`, only the paper's problems in these.
        paper: the paper's 40 problems.
        target: the object to retrieve, as `find_target` takes it; None to have one chosen.
        category: replaces the label.
        config: how scenes are taken over.
    """

    root: Path
    scenes: tuple[int, ...] = ()
    paper: bool = False
    target: str | None = None
    category: Category | None = None
    config: ImportConfig = field(default_factory=ImportConfig)


@dataclass(frozen=True)
class Attempt:
    """What came of one problem that was asked for.

    Attributes:
        scene: number of the scene.
        target: name of the wanted object; None if it was not known yet when it failed.
        problem: None if there is none ...
        reason: ... and why, unless it was there.
        file: where the problem is.
        there: it was there already, from an earlier call.
        in_sight: visible share of the target at first.
        fell: objects that fell off the table and are not in the problem.
        notes: what was odd.
    """

    scene: int
    target: str | None = None
    problem: Problem | None = None
    reason: str = ""
    file: Path | None = None
    there: bool = False
    in_sight: float | None = None
    fell: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def run_import(
    request: ImportRequest,
    inspector: Inspector,
    out: Path,
    overwrite: bool = False,
    say: Say = lambda _: None,
) -> list[Attempt]:
    """Makes the problems that are asked for and saves them, one file each, named like the problem.

    A scene that cannot be read or settled does not stop the others. Of scenes that are the same, one is imported: the
    first that gives a problem, in this call or before it.

    Args:
        request: what to import.
        inspector: the robot that is to solve them: it tells what is in sight and what could be retrieved.
        out: directory of the problem files.
        overwrite: replace files that are there.
        say: told what takes long.

    Raises:
        InputError: the request makes no sense, the root is no GraspClutter6D, or `out` cannot be written.
    """
    wanted = _wanted(request)
    check_root(request.root)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"Cannot make {out}: {error.strerror}. Choose another --out.") from None
    _tell_missing_meshes(request, wanted, say)
    attempts: list[Attempt] = []
    imported: list[AnnotatedScene] = []
    for scene, problems in wanted.items():
        # Known before the work of settling, so that a run that was interrupted is soon where it was.
        there = {} if overwrite else _there(request, scene, problems, inspector, out)
        done = [_kept(out, scene, target, request, inspector) for target in there.values()]
        left = [p for p in problems if p not in there]
        if left:
            made = _attempts(request, scene, left, imported, inspector, say)
            done += [_save(attempt, out, overwrite, request, inspector) for attempt in made]
        if any(attempt.file for attempt in done):
            with suppress(InputError):  # kept, and gone from the data set: nothing can be compared with it
                imported.append(replace(_read(request, scene), others=()))
        attempts += done
    return attempts


_Wanted = dict[int, list[PaperProblem | None]]
"""By scene: the paper's problems in it, or None for one problem as the request says."""


def _tell_missing_meshes(request: ImportRequest, scenes: Iterable[int], say: Say) -> None:
    """Says which scenes lack meshes before any mesh is converted, which takes up to a minute each."""
    for scene in scenes:
        with suppress(InputError):  # a scene that cannot be read is told when its turn comes
            annotated = _read(request, scene)
            try:
                check_meshes(request.root, dict.fromkeys(o.object_id for o in annotated.view.objects))
            except InputError as error:
                say(f"scene {scene} will be left out: {error}")


def _wanted(request: ImportRequest) -> _Wanted:
    image_id(request.config.annotation, request.config.camera)
    placement_rule(request.config.placement)
    if request.target is not None:
        parse_object_name(request.target)
    if not request.paper:
        if not request.scenes:
            raise InputError("Say what to import: --paper for the paper's 40 problems, or --scene NUMBER.")
        return {scene: [None] for scene in request.scenes}
    if request.target is not None:
        raise InputError("--paper has its own targets; leave --target out, or --paper.")
    wanted: _Wanted = {}
    for problem in paper_problems():
        if not request.scenes or problem.scene in request.scenes:
            wanted.setdefault(problem.scene, []).append(problem)
    strange = [str(scene) for scene in request.scenes if scene not in wanted]
    if strange:
        known = ", ".join(str(scene) for scene in dict.fromkeys(p.scene for p in paper_problems()))
        raise InputError(f"The paper has no problem in scene {', '.join(strange)}; its scenes are {known}.")
    return wanted


def _attempts(
    request: ImportRequest,
    scene: int,
    problems: list[PaperProblem | None],
    imported: Sequence[AnnotatedScene],
    inspector: Inspector,
    say: Say,
) -> list[Attempt]:
    """One attempt at each problem of a scene, unless it is the same as one of those `imported` before it."""
    settled = _settled(request, scene, imported, say)
    if isinstance(settled, SceneFailure):
        return [_failed(replace(settled, target=p.target if p else None)) for p in problems]
    say(f"scene {scene}: looking for the target")
    view = inspector.view(settled.problem)
    return [_attempt(request, settled, view, p, inspector) for p in problems]


def _settled(
    request: ImportRequest, scene: int, imported: Sequence[AnnotatedScene], say: Say
) -> SettledScene | SceneFailure:
    try:
        annotated = _read(request, scene)
        twin = next((other.scene for other in imported if same_annotation(other, annotated)), None)
        if twin is not None:
            return SceneFailure(scene, None, f"it is the same as scene {twin}, which is imported already")
        return settle_scene(request.root, annotated, request.config, say)
    except InputError as error:
        return SceneFailure(scene, None, str(error))


def _read(request: ImportRequest, scene: int) -> AnnotatedScene:
    return read_scene(request.root, scene, request.config.annotation, request.config.camera)


def _attempt(
    request: ImportRequest,
    scene: SettledScene,
    view: SceneView,
    published: PaperProblem | None,
    inspector: Inspector,
) -> Attempt:
    wanted = published.target if published else request.target
    by = "the paper" if published else BY_USER if wanted else _BY_RULE
    try:
        found = choose_target(scene, view, inspector) if wanted is None else find_target(scene, wanted)
    except InputError as error:
        found = SceneFailure(scene.scene, wanted, str(error), scene.notes)
    if isinstance(found, SceneFailure):
        return replace(_failed(found), fell=scene.fell)
    in_sight = view.fraction(found)
    facts = {_TARGET_BY: by, **robot_facts(inspector.robot)}
    problem = make_problem(scene, found, in_sight, request.config, request.category, facts)
    return Attempt(scene.scene, found, problem, in_sight=in_sight, fell=scene.fell, notes=scene.notes)


def _failed(failure: SceneFailure) -> Attempt:
    return Attempt(failure.scene, failure.target, reason=failure.reason, notes=failure.notes)


def _save(
    attempt: Attempt, out: Path, overwrite: bool, request: ImportRequest, inspector: Inspector
) -> Attempt:
    if attempt.problem is None:
        return attempt
    file = _file(out, attempt.scene, attempt.problem.target)
    if file.exists() and not overwrite:
        return _kept(out, attempt.scene, attempt.problem.target, request, inspector)
    try:
        save_problem(attempt.problem, file)
    except OSError as error:
        raise InputError(f"Cannot write {file}: {error.strerror}. Choose another --out.") from None
    return replace(attempt, file=file)


def _file(out: Path, scene: int, target: str) -> Path:
    return out / f"{problem_name(scene, target)}.yaml"


def _there(
    request: ImportRequest,
    scene: int,
    problems: Sequence[PaperProblem | None],
    inspector: Inspector,
    out: Path,
) -> dict[PaperProblem | None, str]:
    """Targets of the wanted problems that have a file."""
    targets = {p: p.target if p else _target(request, scene, inspector, out) for p in problems}
    return {p: name for p, name in targets.items() if name and _file(out, scene, name).exists()}


def _target(request: ImportRequest, scene: int, inspector: Inspector, out: Path) -> str | None:
    """Which object is meant, as far as that can be known without the scene."""
    if request.target is not None:
        object_id, instance = parse_object_name(request.target)
        return None if instance is None else f"{object_stem(object_id)}_{instance}"
    for file in sorted(out.glob(f"{problem_name(scene, '')}*.yaml")):
        with suppress(InputError):
            problem = load_problem(str(file))
            if problem.origin.get(_TARGET_BY) == _BY_RULE and _is_asked(problem, scene, request, inspector):
                return problem.target
    return None


def _kept(out: Path, scene: int, target: str, request: ImportRequest, inspector: Inspector) -> Attempt:
    """A file that is there: what was asked for, or a failure if it was imported otherwise."""
    file = _file(out, scene, target)
    try:
        problem = load_problem(str(file))
    except InputError as error:
        return Attempt(scene, target, reason=f"{error} --overwrite replaces it.")
    if not _is_asked(problem, scene, request, inspector):
        return Attempt(
            scene, target, reason=f"{file} is there already, imported otherwise; --overwrite replaces it"
        )
    return Attempt(scene, target, problem, file=file, there=True)


def _is_asked(problem: Problem, scene: int, request: ImportRequest, inspector: Inspector) -> bool:
    asked = how_imported(scene, request.config) | robot_facts(inspector.robot)
    stated = {name: problem.origin[name] for name in (*asked, *ROBOT_KEYS) if name in problem.origin}
    if request.category is None:
        return stated == asked and problem.origin.get("category_by") != BY_USER
    return stated == asked and problem.category == request.category
