"""`torc problems generate`: as many new problems as anyone wants."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import DEFAULT_WORKSPACE

if TYPE_CHECKING:
    from rich.console import Console

    from torc.generation.batch import Job, Progress
    from torc.generation.generator import GeneratedProblem, NotGenerated
    from torc.robots.description import RobotDescription

_MANY_CROWDED = 8
"""Scenes from the first one on that are too crowded, after which there is little hope."""
_FEWER = "So many objects seldom fit side by side: ask for fewer --objects (8-20 are typical)."


@dataclass(frozen=True)
class GenerateCommand:
    """Generate problems: clutter settled in simulation, with a target that takes more than one pick.

    The same options and seed give the same problems on one machine, bit for bit. A problem is kept if its scene stays
    at rest, its target cannot be grasped at first, and the target and every object in front of it, beside it or taller
    can be grasped with nothing in the way. Takes a few seconds a problem. Whether it can really be solved, and in how
    few picks, is another question: see `torc problems validate`.

    Try:
      torc problems generate --count 10 --out mine
      torc problems generate --unstructured --objects 12 --hidden hidden --out piles
      torc run mine/structured-s0000.yaml

    Exit code 0 when all were made, 1 when some were not, 2 on bad arguments.
    """

    structured: bool = False
    """Standing objects, tightly packed. With neither this nor --unstructured: for even seeds."""
    unstructured: bool = False
    """Dumped piles. With neither this nor --structured: for odd seeds."""
    objects: Annotated[str, tyro.conf.arg(metavar="N|N-M")] = "8-20"
    """Number of objects, or a range of it, from 2 to 64; 8-20 are typical. Standing objects must fit side by side: 24
    do in about one scene of three, 32 in hardly any. Piles of 30-40 take about a minute each."""
    count: int = 1
    """How many problems; their seeds are SEED, SEED+1, ... What is in DIR already is not made again: the same command
    goes on after Ctrl-C, and with a larger number it adds to the set."""
    seed: int = 0
    """Seed of the first problem."""
    hidden: Literal["any", "visible", "partly", "hidden"] = "any"
    """How much of the target is in sight at first: visible (75 % or more), partly, hidden (too little for perception to
    find it), or any (prefers targets that are not visible)."""
    held_out: Literal["any", "only", "none"] = "any"
    """Whether to use the object kinds that the grasp score was not trained on."""
    kinds: Annotated[str, tyro.conf.arg(metavar="KIND,...")] = ""
    """Only objects of these kinds, e.g. soup_can,mug,milk_carton."""
    models: Annotated[str, tyro.conf.arg(metavar="MODEL,...")] = ""
    """Only these object models, e.g. soup_can_red,mug_white."""
    own: bool = False
    """Also use objects that you have imported (`torc objects import`). --models may name such ones anyway."""
    robot: str = DEFAULT_ROBOT
    """Robot that the problems are made for: sda10f_2f85, or a robot description file of your own (docs/robots.md)."""
    workspace: str = DEFAULT_WORKSPACE
    """Table, bin and camera: paper, or a workspace file of your own (docs/workspaces.md)."""
    attempts: int = 60
    """Scenes tried for each problem before it is given up."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")] = Path("problems")
    """Directory for the problem files."""
    overwrite: bool = False
    """Make again and replace what is there."""
    workers: int = 1
    """Processes that work at the same time."""
    json: Annotated[bool, tyro.conf.arg(help="Print a JSON summary instead of text.")] = False

    def run(self) -> int:
        """Generate, save and sum up; returns the exit code."""
        import json
        import sys

        from rich.console import Console

        from torc.generation.batch import generate_batch, inspector_for
        from torc.pipeline.warm_up import announced_compilation
        from torc.specs.conditions import Conditions

        conditions = Conditions(robot=self.robot, workspace=self.workspace)
        robot = inspector_for(self.robot, self.workspace).robot  # an unknown one is refused before any work
        all_jobs, console = self._jobs(), Console(stderr=True)
        there = self._there(all_jobs, robot)
        jobs, summary = [job for job in all_jobs if job not in there], _Summary(list(there.values()))
        told = sys.stderr if self.json else sys.stdout
        if there:
            print(f"{len(there)} of {len(all_jobs)} are in {self.out} already.", file=told, flush=True)
        with announced_compilation(lambda text: console.print(text, style="dim")):
            batch = generate_batch(jobs, conditions, self.workers, progress=_teller(console))
            for job, made in batch:
                self._keep(job, made, summary, robot)
                print(summary.lines[-1], file=told, flush=True)
        if self.json:
            print(json.dumps(summary.facts(), indent=2))
        else:
            print(summary.text())
        return 0 if not summary.failed else 1

    def _jobs(self) -> list[Job]:
        from torc.errors import InputError
        from torc.generation.batch import Job
        from torc.generation.choice import allowed_models
        from torc.generation.config import GenerationConfig
        from torc.problems.schema import Category

        if self.count < 1 or self.seed < 0 or self.workers < 1:
            raise InputError("--count and --workers must be at least 1, --seed at least 0.")
        categories: list[Category] = ["structured", "unstructured"]
        if self.structured != self.unstructured:
            categories = ["structured"] if self.structured else ["unstructured"]
        configs = [
            GenerationConfig(
                category,
                _parsed_range(self.objects),
                self.hidden,
                {"any": None, "only": True, "none": False}[self.held_out],
                _parsed_names(self.kinds),
                _parsed_names(self.models),
                self.own,
                self.attempts,
            )
            for category in categories
        ]
        allowed_models(configs[0])
        # By the seed, not by its place in this call: a set that grows is the one that would have been made at once.
        seeds = range(self.seed, self.seed + self.count)
        return [Job(configs[seed % len(configs)], seed) for seed in seeds]

    def _path(self, job: Job) -> Path:
        from torc.generation.generator import problem_name

        return self.out / f"{problem_name(job.config, job.seed)}.yaml"

    def _there(self, jobs: list[Job], robot: RobotDescription) -> dict[Job, Path]:
        """What an earlier call has made of these; made sure of before any work that nothing else is replaced."""
        from torc.errors import InputError

        try:
            self.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"Cannot make '{self.out}': {error.strerror}. Choose another --out.") from error
        return {job: self._path(job) for job in jobs if self._is_there(job, robot)}

    def _is_there(self, job: Job, robot: RobotDescription) -> bool:
        """Whether the problem of this job has a file. Raises InputError where the file is another one's."""
        from torc.errors import InputError
        from torc.generation.generator import is_made_from
        from torc.problems.problem import load_problem

        path = self._path(job)
        if self.overwrite or not path.exists():
            return False
        if not is_made_from(load_problem(str(path)), job.config, job.seed, robot):
            raise InputError(
                f"{path} exists and was made otherwise. Choose another --out or --seed, or replace what is there "
                "with --overwrite."
            )
        return True

    def _keep(
        self, job: Job, made: GeneratedProblem | NotGenerated, summary: _Summary, robot: RobotDescription
    ) -> None:
        from torc.errors import InputError
        from torc.generation.generator import GeneratedProblem
        from torc.problems.problem import save_problem

        path = self._path(job)
        if isinstance(made, GeneratedProblem) and not self._is_there(
            job, robot
        ):  # somebody else may be at it
            try:
                save_problem(made.problem, path)
            except OSError as error:
                raise InputError(f"Cannot write '{path}': {error.strerror}. Choose another --out.") from error
        summary.add(path, job, made)


class _Summary:
    """What was made, and why scenes were rejected."""

    def __init__(self, there: list[Path]) -> None:
        self.there = [str(path) for path in there]
        self.made: list[dict[str, Any]] = []
        self.failed: list[dict[str, Any]] = []
        self.rejections: Counter[str] = Counter()
        self.lines: list[str] = []
        self.scenes = 0

    def add(self, path: Path, job: Job, made: GeneratedProblem | NotGenerated) -> None:
        from torc.generation.generator import GeneratedProblem

        self.scenes += made.attempts
        self.rejections.update({reason.value: n for reason, n in made.rejections.items()})
        facts: dict[str, Any] = {"seed": job.seed, "category": job.config.category, "attempts": made.attempts}
        if isinstance(made, GeneratedProblem):
            self.made.append(
                {
                    "file": str(path),
                    **facts,
                    "objects": made.difficulty.objects,
                    "target": made.problem.description,
                    **made.difficulty.facts(),
                }
            )
            self.lines.append(f"{path}: {made.problem.description}; {made.difficulty.words()}")
        else:
            self.failed.append(facts)
            self.lines.append(f"{path}: not made, none of {made.attempts} scenes holds such a problem")

    def facts(self) -> dict[str, Any]:
        return {
            "there": self.there,
            "made": self.made,
            "failed": self.failed,
            "scenes_tried": self.scenes,
            "rejections": dict(self.rejections.most_common()),
        }

    def text(self) -> str:
        from torc.generation.rejections import Reason

        wanted = len(self.made) + len(self.failed)
        if not wanted:
            return "Nothing was left to make: --overwrite makes it again, another --seed something else."
        there = f" beside the {len(self.there)} that were there" if self.there else ""
        lines = [f"\n{len(self.made)} of {wanted} made{there}, {self.scenes} scenes tried"]
        lines += [f"  {n:>4} rejected: {reason}" for reason, n in self.rejections.most_common()]
        if self.failed:
            crowded = self.rejections.most_common(1)[0][0] == Reason.DOES_NOT_FIT
            lines.append(
                _FEWER if crowded else "Ask for more --attempts, another --hidden, or other --objects."
            )
        return "\n".join(lines)


def _teller(console: Console) -> Progress:
    """Tells of each rejected scene, and what to do where all of the first ones were too crowded."""
    from torc.generation.rejections import Reason

    crowded: Counter[Job] = Counter()

    def tell(job: Job, attempt: int, reason: Reason) -> None:
        crowded[job] += reason is Reason.DOES_NOT_FIT
        console.print(
            f"  {job.config.category} seed {job.seed}, scene {attempt}: {reason.value}",
            style="dim",
            highlight=False,
        )
        # Later scenes may fit yet, and which problem a seed gives must not depend on patience: no more than a hint.
        if attempt == crowded[job] == _MANY_CROWDED:
            console.print(f"{_FEWER} Ctrl-C ends this.", highlight=False, soft_wrap=True)

    return tell


def _parsed_range(text: str) -> tuple[int, int]:
    from torc.errors import InputError

    found = re.fullmatch(r"(\d{1,3})(?:-(\d{1,3}))?", text.strip())
    if found is None:
        raise InputError(f"--objects is '{text}'; give a number, e.g. 12, or a range, e.g. 8-20.")
    low, high = found[1], found[2] or found[1]
    return int(low), int(high)


def _parsed_names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())
