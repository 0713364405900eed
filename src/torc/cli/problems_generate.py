"""`torc problems generate`: any number of new problems."""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from torc.cli.printing import print_json, split_names, tell, teller
from torc.errors import InputError
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import DEFAULT_WORKSPACE

if TYPE_CHECKING:
    from torc.generation.generator import Job


@dataclass(frozen=True)
class GenerateCommand:
    """Generate problems: clutter settled in simulation, with a target that takes more than one pick.

    The same options and seed give the same problems on one machine, bit for bit. A problem is kept if its scene stays
    at rest, its target cannot be grasped at first, and the target and every object in front of it, beside it or taller
    can be grasped with nothing in the way. Takes a few seconds a problem. `torc problems validate` checks whether it
    can really be solved, and in how few picks.

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
    objects: Annotated[str, tyro.conf.arg(metavar="N|N-M")] = ""
    """Number of objects, or a range of it, from 2 to 64; 8-20 if not given. Standing objects must fit side by side: 24
    do in about one scene of three, 32 in hardly any. Piles of 30-40 take about a minute each."""
    count: int = 1
    """How many problems; their seeds are SEED, SEED+1, ... What is in DIR already is not made again: the same command
    goes on after Ctrl-C, and with a larger number it adds to the set."""
    seed: int = 0
    """Seed of the first problem."""
    hidden: Literal["any", "visible", "partly", "hidden"] = "any"
    """How much of the target is in sight at first: visible (75 % or more), partly, hidden (too little for perception to
    find it), or any (prefers targets that are not visible)."""
    family: str = "usual"
    """Family of harder problems (docs/problems.md), or your own as module:Class or path/to/file.py:Class."""
    held_out: Literal["any", "only", "none"] = "any"
    """Whether to use the object kinds that the grasp score was not trained on."""
    kinds: Annotated[str, tyro.conf.arg(metavar="KIND,...")] = ""
    """Only objects of these kinds, e.g. soup_can,mug,milk_carton."""
    models: Annotated[str, tyro.conf.arg(metavar="MODEL,...")] = ""
    """Only these object models, e.g. soup_can_red,mug_white."""
    own: bool = False
    """Also use objects that you have imported (`torc objects import`). --models may name such ones anyway."""
    robot: str = DEFAULT_ROBOT
    """Robot that the problems are made for: sda10f_2f85, ur5e_2f85, panda_hand, or a robot description file of your own
    (docs/robots.md)."""
    workspace: str = DEFAULT_WORKSPACE
    """Table, bin, camera and walls: paper, deep-box (a box on the table, for piles), deep-shelf (a shelf with a roof;
    --structured), or a workspace file of your own (docs/robots.md)."""
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
        from torc.generation.config import Reason
        from torc.generation.generator import (
            GeneratedProblem,
            Job,
            generate_batch,
            inspector_for,
            is_made_from,
            named,
            problem_name,
        )
        from torc.pipeline.warm_up import announced_compilation
        from torc.problems.problem import load_problem, save_problem
        from torc.specs.conditions import Conditions

        conditions = Conditions(robot=self.robot, workspace=self.workspace)
        inspector = inspector_for(self.robot, self.workspace)  # unknown names are refused before any work
        say = teller(self.json)
        jobs = {job: self.out / f"{problem_name(job.config, job.seed)}.yaml" for job in self._jobs()}
        self.out.mkdir(parents=True, exist_ok=True)
        there = [job for job, path in jobs.items() if path.exists() and not self.overwrite]
        for job in there:
            robot, workspace = inspector.robot, named(inspector.workspace)
            if not is_made_from(load_problem(jobs[job]), job.config, job.seed, robot, workspace):
                raise InputError(
                    f"{jobs[job]} exists and was made otherwise. Choose another --out or --seed, or replace what is "
                    "there with --overwrite."
                )
        if there:
            say(f"{len(there)} of {len(jobs)} are in {self.out} already.")
        left = [job for job in jobs if job not in there]
        made: list[dict[str, Any]] = []
        failed: list[dict[str, Any]] = []
        scenes, rejections = 0, Counter[str]()

        def progress(job: Job, attempt: int, reason: Reason) -> None:
            tell(f"  {job.config.category} seed {job.seed}, scene {attempt}: {reason.value}")

        with announced_compilation(tell):
            for job, found in generate_batch(left, conditions, self.workers, progress=progress):
                path = jobs[job]
                scenes += found.attempts
                rejections.update({reason.value: n for reason, n in found.rejections.items()})
                facts = {"seed": job.seed, "category": job.config.category, "attempts": found.attempts}
                if isinstance(found, GeneratedProblem):
                    save_problem(found.problem, path)
                    target = {"objects": found.difficulty.objects, "target": found.problem.description}
                    made.append({"file": str(path), **facts, **target, **found.difficulty.facts()})
                    say(f"{path}: {found.problem.description}; {found.difficulty.words()}")
                else:
                    failed.append(facts)
                    say(f"{path}: not made, none of {found.attempts} scenes holds such a problem")
        if self.json:
            summary = {"there": [str(jobs[job]) for job in there], "made": made, "failed": failed}
            print_json(summary | {"scenes_tried": scenes, "rejections": dict(rejections.most_common())})
            return 1 if failed else 0
        if not left:
            print("Nothing was left to make: --overwrite makes it again, another --seed something else.")
            return 0
        beside = f" beside the {len(there)} that were there" if there else ""
        print(f"\n{len(made)} of {len(left)} made{beside}, {scenes} scenes tried")
        for reason, n in rejections.most_common():
            print(f"  {n:>4} rejected: {reason}")
        if failed:
            print("Ask for fewer --objects (8-20 are typical), more --attempts or another --hidden.")
        return 1 if failed else 0

    def _jobs(self) -> list["Job"]:
        from torc.generation.config import GenerationConfig
        from torc.generation.families import scene_family
        from torc.generation.generator import Job
        from torc.generation.sampling import allowed_models
        from torc.problems.schema import Category

        if self.count < 1 or self.workers < 1:
            raise InputError("--count and --workers must be at least 1.")
        family = "" if self.family == "usual" else self.family
        only = scene_family(family).category
        wanted = self.objects.strip() or scene_family(family).objects
        found = re.fullmatch(r"(\d{1,3})(?:-(\d{1,3}))?", wanted)
        if found is None:
            raise InputError(f"--objects is '{self.objects}'; give a number, e.g. 12, or a range, e.g. 8-20.")
        categories: list[Category] = ["structured", "unstructured"]
        if self.structured != self.unstructured:
            categories = ["structured"] if self.structured else ["unstructured"]
        elif only is not None:
            categories = [only]
        configs = [
            GenerationConfig(
                category,
                (int(found[1]), int(found[2] or found[1])),
                self.hidden,
                {"any": None, "only": True, "none": False}[self.held_out],
                split_names(self.kinds),
                split_names(self.models),
                self.own,
                self.attempts,
                family=family,
            )
            for category in categories
        ]
        allowed_models(configs[0])
        # By the seed, not by its place in this call: a set made in several calls equals one made at once.
        seeds = range(self.seed, self.seed + self.count)
        return [Job(configs[seed % len(configs)], seed) for seed in seeds]
