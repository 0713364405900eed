"""`torc decide`: only the brain, for a frame from anywhere."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.printing import print_json, tell
from torc.cli.vlm_options import VlmOptions
from torc.specs.conditions import PipelineSpec

NO_CHOICE = 3
"""Exit code of a decision without an object."""


@dataclass(frozen=True)
class DecideCommand:
    """Decide which object to pick next in a saved RGB-D frame with masks.

    PATH is a .npz file or a directory. The file holds

      rgb             height x width x 3, uint8
      depth_m         metres along the optical axis, 0.1 to 10 m; 0 or NaN for no
                      reading (or depth, integers, with depth_scale: metres a unit)
      K               3x3 intrinsics
      T_world_camera  4x4 camera pose: OpenCV camera axes, z of the world up, metres
      labels          a whole number per object, 0 for the background
      target          the target's label, or "hidden"

    and, if you like, target_description, background and robot (their labels, if others than 0 or -1, and -2), and
    support_z_m, the height of the table, which is estimated otherwise. The directory holds rgb.png, depth.png,
    labels.png and frame.json with the rest, where depth_scale is called depth_scale_m: docs/frames.md. Try it out with
    examples/frame.npz.

    The answer names objects by your labels, and JSON holds the grasps of the chosen one, the best first. Where there is
    nothing to pick it tells why, per object, and the exit code is 3.
    """

    frame: tyro.conf.Positional[Path]
    """The frame: .npz file or directory."""
    planner: str = "dg-select"
    """Task planner: dg-select, random, vlm-select, vlm-grasps, vlm-fixes-dg (these three ask the model --vlm), or your
    own as module:Class or path/to/file.py:Class."""
    robot: str = "none"
    """Robot whose reach counts: none (only the gripper is checked), sda10f_2f85, or a robot description file. With a
    robot the world is its base frame."""
    seed: int = 0
    """Decides all random draws."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for decision.json, seen.png and graph.png."""
    json: Annotated[bool, tyro.conf.arg(help="Print decision.json instead of text.")] = False
    stages: PipelineSpec = field(default_factory=PipelineSpec)
    vlm: VlmOptions = field(default_factory=VlmOptions)

    def run(self) -> int:
        """Print the decision; the exit code is 3 if there is nothing to pick."""
        from torc.brain import answer_text, decide_frame, load_frame, rehearse
        from torc.episode.planners import refuse_simulated
        from torc.pipeline.warm_up import announced_compilation
        from torc.records.files import write_json
        from torc.task_planning.registry import load_planner_class, make_planner
        from torc.vlm.opening import planner_options

        refuse_simulated(self.planner)
        maker = load_planner_class(self.planner)
        options = planner_options(self.planner, maker, self.vlm.config(), self.vlm.cache())
        planner, frame = make_planner(self.planner, **options), load_frame(self.frame)
        robot = None if self.robot == "none" else self.robot
        with announced_compilation(tell):
            rehearse(frame, planner, robot=robot, stages=self.stages)
        answer = decide_frame(frame, planner, robot=robot, seed=self.seed, stages=self.stages)
        if self.out is not None:
            self.out.mkdir(parents=True, exist_ok=True)
            write_json(self.out / "decision.json", answer.to_dict())
            answer.save_pictures(self.out)
        if self.json:
            print_json(answer.to_dict())
        else:
            print(answer_text(answer))
        return 0 if answer.decision.object_id is not None else NO_CHOICE
