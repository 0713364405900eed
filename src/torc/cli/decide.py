"""`torc decide`: only the brain, for a frame from anywhere."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class DecideCommand:
    """Decide which object to pick next in a saved RGB-D frame with masks.

    FRAME is a .npz file with rgb, depth_m (or depth and depth_scale), K, T_world_camera (OpenCV camera frame, world z
    up, metres) and labels (an integer per object, 0 for the background); or a directory with rgb.png, depth.png,
    labels.png and frame.json, which holds the same. `target` is the target's label, or "hidden"; further optional keys
    are target_description and support_z_m, the height of the table. No simulator is needed: the answer, the
    dependency graph and the probabilities, as text, as JSON and as pictures.
    """

    frame: tyro.conf.Positional[Path]
    """The frame: .npz file or directory."""
    planner: str = "dg-select"
    """Task planner: dg-select, random, or your own as module:Class."""
    robot: str = "none"
    """Robot whose reach counts: none, sda10f_2f85, or a robot description file."""
    seed: int = 0
    """Decides all random draws."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for decision.json, seen.png and graph.png."""
    json: Annotated[bool, tyro.conf.arg(help="Print decision.json instead of text.")] = False

    def run(self) -> int:
        """Print the decision; exit code 0 also when there is nothing to pick."""
        import json
        import sys

        from torc.brain import decide_frame, load_frame
        from torc.episode.recorder import write_json
        from torc.errors import InputError
        from torc.pipeline.warm_up import compiling_once
        from torc.task_planning.registry import make_planner

        planner, frame = make_planner(self.planner), load_frame(self.frame)
        with compiling_once(lambda text: print(text, file=sys.stderr), f"decide-{self.robot != 'none'}"):
            answer = decide_frame(
                frame, planner, robot=None if self.robot == "none" else self.robot, seed=self.seed
            )
        if self.out is not None:
            try:
                self.out.mkdir(parents=True, exist_ok=True)
                write_json(self.out / "decision.json", answer.to_dict())
                answer.save_pictures(self.out)
            except OSError as error:
                raise InputError(
                    f"Cannot write to '{self.out}': {error.strerror}. Choose another --out."
                ) from error
        print(json.dumps(answer.to_dict(), indent=2) if self.json else answer.text())
        return 0
