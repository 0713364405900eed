"""The problems of imported scenes: which are requested, one attempt at each, and the outcomes."""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path

from torc.errors import InputError
from torc.generation.graspclutter6d.placing import LICENCE, ImportConfig, Say, SettledScene, settle_scene
from torc.generation.graspclutter6d.reading import (
    check_root,
    image_id,
    object_stem,
    paper_problems,
    parse_object_name,
    published_category,
    read_scene,
)
from torc.generation.inspection import Inspector, SceneView, robot_facts
from torc.objects.library import object_description
from torc.problems.problem import ROBOT_KEYS, Problem, load_problem, save_problem
from torc.problems.schema import Category, Scalar

BY_USER = "the user"


def problem_name(scene: int, target: str) -> str:
    """Return the name of the problem of retrieving one object of a scene: gc6d-249-obj_000017_0."""
    return f"gc6d-{scene}-{target}"


def how_imported(scene: int, config: ImportConfig) -> dict[str, Scalar]:
    """Return entries of a problem's `origin`."""
    how = {name: getattr(config, name) for name in ("annotation", "camera", "placement")}
    return {"source": "GraspClutter6D", "scene": scene, **how}


def make_problem(
    scene: SettledScene,
    target: str,
    in_sight: float,
    config: ImportConfig,
    category: Category | None = None,
    facts: dict[str, Scalar] | None = None,
) -> Problem:
    """Return the problem of retrieving one object of a settled scene, of which the robot sees a share at first.

    `category` replaces the authors' label; `facts` are further entries of `origin`.
    """
    label, by = category or published_category(scene.number), BY_USER if category else "the authors' label"
    model = next(o.model for o in scene.problem.objects if o.name == target)
    alike = sum(o.model == model for o in scene.problem.objects)
    notes = [f"{round(100 * in_sight)}% of the target is in sight at first."]
    if alike > 1:
        notes.append(f"There are {alike} objects like the target.")
    notes += [f"{note[0].upper()}{note[1:]}." for note in scene.notes]
    origin = how_imported(scene.number, config) | {"category_by": by, "licence": LICENCE} | (facts or {})
    return replace(
        scene.problem,
        name=problem_name(scene.number, target),
        category=label,
        description=object_description(model),
        target=target,
        notes=" ".join(notes)[:2000],
        origin=origin,
    )


def find_target(scene: SettledScene, wanted: str) -> str:
    """Return the name of the object that a user means by "44_1", "obj_000044_1" or "44".

    Raises InputError if it is not in the scene, is ambiguous, or fell off the table.
    """
    object_id, instance = parse_object_name(wanted)
    parsed = {name: parse_object_name(name) for name in scene.annotated}
    names = [name for name, (i, k) in parsed.items() if i == object_id and instance in (None, k)]
    if not names:
        raise InputError(
            f"Scene {scene.number} has no object {wanted}. It has: {', '.join(scene.annotated)}."
        )
    if len(names) > 1:
        times = f"{len(names)} times: say which: {', '.join(names)}"
        raise InputError(f"Scene {scene.number} has object {wanted} {times}.")
    if names[0] in scene.fell:
        raise InputError("the target fell off the table while settling")
    return names[0]


def choose_target(scene: SettledScene, view: SceneView, inspector: Inspector) -> str:
    """Return the least visible object that makes a problem by the paper's rules; ties go by file order.

    It and all objects around it (in front, within 15 cm beside, taller) can be grasped when they stand alone, or it
    could never be retrieved; and it cannot be grasped at once, or the problem would be trivial. Raises InputError if
    there is none.
    """
    can_grasp = cache(partial(inspector.graspable_at_all, scene.problem))
    outcomes: Counter[str] = Counter()
    for name in sorted((o.name for o in scene.problem.objects), key=view.fraction):
        if not all(can_grasp(other) for other in (name, *inspector.around(scene.problem, name).all)):
            outcomes["cannot be retrieved"] += 1
        elif inspector.graspable_at_first(view, name):
            outcomes["can be picked at once"] += 1
        else:
            return name
    told = ", ".join(f"{count} {what}" for what, count in outcomes.items())
    raise InputError(f"no object makes a problem: {told}; name one with --target to have it all the same")


_BY_RULE, _BY_PAPER = "torc", "the paper"


@dataclass(frozen=True)
class ImportRequest:
    """A request to import from a data set: scenes by number, or the paper's 40 problems (those in `scenes`, if named).

    `target` is the object to retrieve, as for `find_target`; None to have one chosen. `category` replaces the label.
    """

    root: Path
    scenes: tuple[int, ...] = ()
    paper: bool = False
    target: str | None = None
    category: Category | None = None
    config: ImportConfig = field(default_factory=ImportConfig)

    def wanted(self) -> dict[int, list[str | None]]:
        """Return the targets in each scene, None for one to be chosen. Raises InputError for a bad request."""
        image_id(self.config.annotation, self.config.camera)
        if self.target is not None:
            parse_object_name(self.target)
        if not self.paper and not self.scenes:
            raise InputError("Say what to import: --paper for the paper's 40 problems, or --scene NUMBER.")
        if not self.paper:
            return {scene: [self.target] for scene in self.scenes}
        if self.target is not None:
            raise InputError("--paper has its own targets; leave --target out, or --paper.")
        wanted: dict[int, list[str | None]] = {}
        for problem in paper_problems():
            wanted.setdefault(problem.scene, []).append(problem.target)
        if strange := [str(scene) for scene in self.scenes if scene not in wanted]:
            known = ", ".join(map(str, wanted))
            raise InputError(
                f"The paper has no problem in scene {', '.join(strange)}; its scenes are {known}."
            )
        return {scene: targets for scene, targets in wanted.items() if scene in (self.scenes or wanted)}


@dataclass(frozen=True)
class Attempt:
    """The outcome for one requested problem: the problem and its file, or the reason why there is none; whether an
    earlier call made it, how much of the target is in sight at first, and which objects fell off the table.
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
    """Make the requested problems and save them, one file each, named like the problem.

    A scene that cannot be read or settled does not stop the others. Problems of an earlier call are kept, unless
    `overwrite`. Raises InputError if the request is inconsistent, its root is wrong, or `out` cannot be written.
    """
    wanted = request.wanted()
    check_root(request.root)
    attempts: list[Attempt] = []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for scene, targets in wanted.items():
            # Checked before the work of settling, so that an interrupted run quickly catches up.
            kept = {t: None if overwrite else _kept(request, inspector, scene, t, out) for t in targets}
            attempts += filter(None, kept.values())
            new = _attempts(request, scene, [t for t in targets if not kept[t]], inspector, say)
            attempts += [_saved(attempt, out, overwrite) for attempt in new]
    except OSError as error:
        raise InputError(f"Cannot write {out}: {error.strerror}. Choose another --out.") from None
    return attempts


def _attempts(
    request: ImportRequest, scene: int, targets: list[str | None], inspector: Inspector, say: Say
) -> list[Attempt]:
    if not targets:
        return []
    try:
        annotated = read_scene(request.root, scene, request.config.annotation, request.config.camera)
        settled = settle_scene(request.root, annotated, request.config, say)
    except InputError as error:
        return [Attempt(scene, target, reason=str(error)) for target in targets]
    say(f"scene {scene}: looking for the target")
    view = inspector.view(settled.problem)
    attempts = []
    for wanted in targets:
        attempt = Attempt(scene, wanted, fell=settled.fell, notes=settled.notes)
        by = _BY_PAPER if request.paper else BY_USER if wanted else _BY_RULE
        try:
            target = find_target(settled, wanted) if wanted else choose_target(settled, view, inspector)
            in_sight, facts = view.fraction(target), {"target_by": by, **robot_facts(inspector.robot)}
            problem = make_problem(settled, target, in_sight, request.config, request.category, facts)
            attempts.append(replace(attempt, target=target, problem=problem, in_sight=in_sight))
        except InputError as error:
            attempts.append(replace(attempt, reason=str(error)))
    return attempts


def _saved(attempt: Attempt, out: Path, overwrite: bool) -> Attempt:
    """Return the attempt with its problem's file, if it has one, which is written unless an equal problem is there."""
    if (problem := attempt.problem) is None:
        return attempt
    file = out / f"{problem.name}.yaml"
    if file.exists() and not overwrite:
        with suppress(InputError):
            old = load_problem(file)
            if (old.objects, old.origin) == (problem.objects, problem.origin):
                return replace(attempt, problem=old, file=file, there=True)
        reason = f"{file} is there already, imported otherwise; --overwrite replaces it"
        return replace(attempt, problem=None, reason=reason)
    save_problem(problem, file)
    return replace(attempt, file=file)


def _kept(
    request: ImportRequest, inspector: Inspector, scene: int, wanted: str | None, out: Path
) -> Attempt | None:
    """Return an earlier call's result for a wanted problem; None without one, or while the object is unknown."""
    asked = how_imported(scene, request.config) | robot_facts(inspector.robot)
    pattern = "*"
    if wanted is not None:
        object_id, instance = parse_object_name(wanted)
        pattern = f"{object_stem(object_id)}_{instance}"
    for file in sorted(out.glob(f"{problem_name(scene, pattern)}.yaml")):
        with suppress(InputError):
            problem = load_problem(file)
            same = all(problem.origin.get(key) == asked.get(key) for key in (*asked, *ROBOT_KEYS))
            chosen = wanted is not None or problem.origin.get("target_by") == _BY_RULE
            if same and chosen and request.category in (None, problem.category):
                return Attempt(scene, problem.target, problem, file=file, there=True)
    return None
