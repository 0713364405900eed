"""`torc problems import`: scenes of GraspClutter6D as problems."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from torc.cli.options import RobotOption
from torc.cli.printing import print_json, teller
from torc.robots.names import DEFAULT_ROBOT

_PAPERS_OWN = (
    "Many of the paper's 40 problems do not hold by `torc problems validate`: their target can be grasped at once, or "
    "a neighbour of it cannot be. In the authors' own trials the median of RANDOM, DG-SELECT or HUMAN was 2 picks or "
    "less on 17 of them. They are imported all the same."
)


@dataclass(frozen=True)
class ImportCommand:
    """Turn scenes of GraspClutter6D into problems.

    ROOT is the unpacked data set, with scenes/ and models_obj_m/ (docs/problems.md says how to get it;
    of the scenes only the .json files are needed). Each scene is put on torc's table as annotated and settled in
    simulation; what fell off is left out and named. Meshes are converted once and kept with your objects
    (`torc objects list`).

      torc problems import ~/GraspClutter6D --paper        # the paper's 40 problems
      torc problems import ~/GraspClutter6D --scene 249 --target 17_0

    Problems already in DIR are not made again: the same command continues after Ctrl-C.

    Exit code 0 when every problem asked for is there, 1 when some were not (each with its reason), 2 on bad arguments.
    """

    root: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="ROOT")]
    """Directory of the data set."""
    scene: tyro.conf.UseAppendAction[tuple[int, ...]] = ()
    """Number of a scene; give it once per scene."""
    paper: bool = False
    """The 40 scenes and targets of the retrieval paper; with --scene, those of these scenes."""
    target: Annotated[str | None, tyro.conf.arg(metavar="OBJ")] = None
    """What to retrieve: 44_1 is the second object 44 of the scene, 17 the only object 17. If not given: the object that
    is least in sight among those that the robot could retrieve."""
    category: Literal["structured", "unstructured"] | None = None
    """Replaces the label, which is the paper's authors' (made by hand for all 1000 scenes)."""
    placement: Literal["torc", "paper"] = "torc"
    """Where on the table: where torc's arm reaches best, or where the paper's authors put it, 10 cm farther away."""
    annotation: int = 3
    """Which of a scene's 13 annotations to take; the paper took 3."""
    camera: str = "realsense-d435"
    """Whose pictures the annotation is of: realsense-d415, realsense-d435, azure-kinect or zivid."""
    robot: RobotOption = DEFAULT_ROBOT
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")] = Path("graspclutter6d-problems")
    """Where the problem files go."""
    overwrite: bool = False
    """Make again and replace problem files that are there."""
    json: bool = False
    """Print what was made, and what was not and why, as JSON."""

    def run(self) -> int:
        from torc.generation.generator import inspector_for
        from torc.generation.graspclutter6d.making import ImportRequest, run_import
        from torc.generation.graspclutter6d.placing import ImportConfig

        say = teller(self.json)
        if self.paper:
            say(_PAPERS_OWN)
        request = ImportRequest(
            root=self.root,
            scenes=self.scene,
            paper=self.paper,
            target=self.target,
            category=self.category,
            config=ImportConfig(self.placement, self.annotation, self.camera),
        )
        rows: list[dict[str, Any]] = []
        for attempt in run_import(request, inspector_for(self.robot), self.out, self.overwrite, say=say):
            names, problem = ("scene", "in_sight", "fell", "there", "reason", "notes"), attempt.problem
            row = {name: getattr(attempt, name) for name in names}
            row |= {"file": str(attempt.file) if attempt.file else None, "target": attempt.target}
            if problem is not None:
                row |= {key: getattr(problem, key) for key in ("target", "category", "description")}
                row["objects"] = len(problem.objects)
            rows.append(row)
        done = [str(row["file"]) for row in rows if row["file"]]
        if self.json:
            print_json(rows)
        else:
            for row in rows:
                where = f"scene {row['scene']}" + (f", {row['target']}" if row["target"] else "")
                if row["there"]:
                    print(f"there  {where}: {row['file']}")
                elif row["file"]:
                    print(
                        f"made   {where}: {row['description']}, {row['category']}, {row['objects']} objects"
                    )
                else:
                    print(f"failed {where}: {row['reason']}")
            print(f"\n{len(done)} of {len(rows)} problems are in {self.out}.")
            if done:
                print(f"Play one: torc run {shlex.quote(done[0])}")
        return 0 if len(done) == len(rows) else 1
