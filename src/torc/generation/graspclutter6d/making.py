"""The problems of imported scenes: which are asked for, one attempt at each, and what came of it."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from torc.errors import InputError
from torc.generation.graspclutter6d.objects import check_meshes
from torc.generation.graspclutter6d.placing import ImportConfig, Say, settle_scene
from torc.generation.graspclutter6d.published import paper_problems, parse_object_name
from torc.generation.graspclutter6d.reading import (
    AnnotatedScene,
    check_root,
    image_id,
    object_stem,
    read_scene,
)
from torc.generation.graspclutter6d.targets import (
    BY_USER,
    choose_target,
    find_target,
    how_imported,
    make_problem,
    problem_name,
)
from torc.generation.inspection import Inspector, robot_facts
from torc.problems.made_for import ROBOT_KEYS
from torc.problems.problem import Problem, load_problem, save_problem
from torc.problems.schema import Category

_BY_RULE, _BY_PAPER = "torc", "the paper"


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

    def wanted(self) -> dict[int, list[str | None]]:
        """The targets in each scene; None for one that has to be chosen.

        Raises:
            InputError: the request makes no sense.
        """
        image_id(self.config.annotation, self.config.camera)
        if self.target is not None:
            parse_object_name(self.target)
        if not self.paper:
            if not self.scenes:
                raise InputError(
                    "Say what to import: --paper for the paper's 40 problems, or --scene NUMBER."
                )
            return {scene: [self.target] for scene in self.scenes}
        if self.target is not None:
            raise InputError("--paper has its own targets; leave --target out, or --paper.")
        wanted: dict[int, list[str | None]] = {}
        for problem in paper_problems():
            wanted.setdefault(problem.scene, []).append(problem.target)
        strange = [str(scene) for scene in self.scenes if scene not in wanted]
        if strange:
            known = ", ".join(map(str, wanted))
            raise InputError(
                f"The paper has no problem in scene {', '.join(strange)}; its scenes are {known}."
            )
        return {scene: targets for scene, targets in wanted.items() if scene in (self.scenes or wanted)}

    def read(self, scene: int) -> AnnotatedScene:
        """A scene of the data set. Raises InputError."""
        return read_scene(self.root, scene, self.config.annotation, self.config.camera)


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
    wanted = request.wanted()
    check_root(request.root)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"Cannot make {out}: {error.strerror}. Choose another --out.") from None
    _tell_missing_meshes(request, wanted, say)
    attempts: list[Attempt] = []
    imported: list[AnnotatedScene] = []
    folder = _Folder(out, request, inspector)
    for scene, targets in wanted.items():
        # Known before the work of settling, so that a run that was interrupted is soon where it was.
        there = {} if overwrite else {t: kept for t in targets if (kept := folder.kept(scene, t))}
        done, left = list(there.values()), [t for t in targets if t not in there]
        if left:
            made = _attempts(request, scene, left, imported, inspector, say)
            done += [folder.save(attempt, overwrite) for attempt in made]
        if any(attempt.file for attempt in done):
            with suppress(InputError):  # kept, and gone from the data set: nothing can be compared with it
                imported.append(request.read(scene))
        attempts += done
    return attempts


def _tell_missing_meshes(request: ImportRequest, scenes: Iterable[int], say: Say) -> None:
    """Says which scenes lack meshes before any mesh is converted, which takes up to a minute each."""
    for scene in scenes:
        with suppress(InputError):  # a scene that cannot be read is told when its turn comes
            annotated = request.read(scene)
            try:
                check_meshes(request.root, dict.fromkeys(o.object_id for o in annotated.objects))
            except InputError as error:
                say(f"scene {scene} will be left out: {error}")


def _attempts(
    request: ImportRequest,
    scene: int,
    targets: list[str | None],
    imported: Sequence[AnnotatedScene],
    inspector: Inspector,
    say: Say,
) -> list[Attempt]:
    """One attempt at each problem of a scene, unless it is the same as one of those `imported` before it."""
    try:
        annotated = request.read(scene)
        for other in imported:
            if other.is_same(annotated):
                raise InputError(f"it is the same as scene {other.number}, which is imported already")
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
        except InputError as error:
            attempts.append(replace(attempt, reason=str(error)))
            continue
        in_sight, facts = view.fraction(target), {"target_by": by, **robot_facts(inspector.robot)}
        problem = make_problem(settled, target, in_sight, request.config, request.category, facts)
        attempts.append(replace(attempt, target=target, problem=problem, in_sight=in_sight))
    return attempts


@dataclass(frozen=True)
class _Folder:
    """Problem files, and which of them are what a request asks for."""

    path: Path
    request: ImportRequest
    inspector: Inspector

    def save(self, attempt: Attempt, overwrite: bool) -> Attempt:
        """Writes the problem of an attempt, if it has one, unless the file is there."""
        if attempt.problem is None:
            return attempt
        file = self._file(attempt.scene, attempt.problem.target)
        if file.exists() and not overwrite:
            return self._loaded(attempt.scene, attempt.problem.target)
        try:
            save_problem(attempt.problem, file)
        except OSError as error:
            raise InputError(f"Cannot write {file}: {error.strerror}. Choose another --out.") from None
        return replace(attempt, file=file)

    def kept(self, scene: int, target: str | None) -> Attempt | None:
        """What is there of a wanted problem; None if nothing, or if which object is meant is not known yet."""
        if target is None:
            name = self._chosen_before(scene)
        else:
            object_id, instance = parse_object_name(target)
            name = None if instance is None else f"{object_stem(object_id)}_{instance}"
        return self._loaded(scene, name) if name and self._file(scene, name).exists() else None

    def _chosen_before(self, scene: int) -> str | None:
        for file in sorted(self.path.glob(f"{problem_name(scene, '')}*.yaml")):
            with suppress(InputError):
                problem = load_problem(str(file))
                if problem.origin.get("target_by") == _BY_RULE and self._is_asked(problem, scene):
                    return problem.target
        return None

    def _loaded(self, scene: int, target: str) -> Attempt:
        """A file that is there: what was asked for, or a failure if it was imported otherwise."""
        file = self._file(scene, target)
        try:
            problem = load_problem(str(file))
        except InputError as error:
            return Attempt(scene, target, reason=f"{error} --overwrite replaces it.")
        if self._is_asked(problem, scene):
            return Attempt(scene, target, problem, file=file, there=True)
        reason = f"{file} is there already, imported otherwise; --overwrite replaces it"
        return Attempt(scene, target, reason=reason)

    def _is_asked(self, problem: Problem, scene: int) -> bool:
        asked = how_imported(scene, self.request.config) | robot_facts(self.inspector.robot)
        stated = {name: problem.origin[name] for name in (*asked, *ROBOT_KEYS) if name in problem.origin}
        if self.request.category is None:
            return stated == asked and problem.origin.get("category_by") != BY_USER
        return stated == asked and problem.category == self.request.category

    def _file(self, scene: int, target: str) -> Path:
        return self.path / f"{problem_name(scene, target)}.yaml"
