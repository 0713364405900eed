"""`torc decide`: the brain alone, for a frame from anywhere."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.options import VlmOptions, wanted_of
from torc.cli.printing import print_json, tell
from torc.errors import InputError
from torc.specs.conditions import PipelineSpec

NO_CHOICE = 3
"""Exit code of a decision without an object."""


@dataclass(frozen=True)
class DecideCommand:
    """Decide which object to pick next in a saved RGB-D frame.

    PATH is a .npz file or a directory. The file holds

      rgb             height x width x 3, uint8
      depth_m         metres along the optical axis, 0.1 to 10 m; 0 or NaN for no
                      reading (or depth, integers, with depth_scale: metres a unit)
      K               3x3 intrinsics
      T_world_camera  4x4 camera pose: OpenCV camera axes, z of the world up, metres

    and, if you like, support_z_m, the height of the table, which is estimated otherwise, and masks:

      labels          a whole number per object, 0 for the background
      target          the target's label, or "hidden"

    Without masks torc finds the objects itself, and T_world_camera may be missing: then it is estimated, with the table
    level at z = 0, and --robot cannot be used. `torc camera record` writes such frames. Say which object is the target
    by reference pictures (--reference), by a pixel or box (--mark), or by target_description and a model that looks for
    it (--vlm); else it counts as hidden. The directory holds rgb.png, depth.png, frame.json with the rest, where
    depth_scale is called depth_scale_m, and, if there are masks, labels.png: docs/frames.md. Try it out with
    examples/frame.npz.

    The answer names objects by your labels, and JSON holds the grasps of the chosen one, the best first. If there is
    nothing to pick, it says why, per object, and the exit code is 3.
    """

    frame: tyro.conf.Positional[Path]
    """The frame: .npz file or directory."""
    planner: str = "dg-select"
    """Task planner."""
    robot: str = "none"
    """Robot whose reach counts: none (only the gripper is checked), sda10f_2f85, ur5e_2f85, panda_hand, or a robot
    description file. With a robot the world is its base frame."""
    mark: str = ""
    """Without masks: a pixel of the target, as COLUMN,ROW, or a box around it, as LEFT,TOP,RIGHT,BOTTOM."""
    reference: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="PICTURE...")] = ()
    """Without masks: pictures of the target from some sides, one to five will do, each filled by it; with an alpha
    channel if it does not fill them."""
    target_size: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="LENGTH THICKNESS")] = None
    """How long the target is, corner to corner, and the width of the narrowest tube it goes through, in metres. Beside
    pictures of it, that tells things apart that look alike; and `--planner belief` knows where there is room for it."""
    description: str = ""
    """The target in words, in place of the frame's target_description."""
    seed: int = 0
    """Decides all random draws."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for decision.json, seen.png and, if the planner has them, graph.png and belief.png."""
    json: Annotated[bool, tyro.conf.arg(help="Print decision.json instead of text.")] = False
    stages: PipelineSpec = field(default_factory=PipelineSpec)
    vlm: VlmOptions = field(default_factory=VlmOptions)

    def run(self) -> int:
        from torc.brain import FrameDecider, answer_text, load_frame
        from torc.io.results import write_json
        from torc.pipeline.planners import (
            asking_planners,
            asks_model,
            load_planner,
            make_spec_planner,
            open_client,
            refuse_simulated,
        )
        from torc.pipeline.warm_up import announced_compilation
        from torc.specs.trial import PlannerSpec

        refuse_simulated(self.planner)
        frame = load_frame(self.frame)
        model = self.vlm.config()
        masked = frame.label_image is not None
        if masked and (self.mark or self.reference) and self.stages.perception == "labels":
            raise InputError(
                "--mark and --reference are for frames without masks; in one with masks `target` says which is the "
                "target. Leave the options out, or the labels, or add --perception embedded."
            )
        if self.mark and self.reference:
            raise InputError("--mark and --reference both say which object is the target: give one of them.")
        description = self.description or frame.target_description
        wanted = wanted_of(description, self.reference, self.mark, self.target_size, optional=True)
        # With a planner that asks no model, the model of a frame without masks looks for the target.
        looks = model if not (masked or wanted.mark or wanted.pictures) else None
        finder = None if looks is None else open_client(looks, self.vlm.cache())
        asks = asks_model(load_planner(self.planner)) or looks is None
        if model is not None and model.words and not asks:
            raise InputError(
                "The model only looks for the target here, which it does by pictures and a prompt of torc's own: leave "
                "out --vlm-marks, --vlm-plain, --vlm-crop, --vlm-longest-side and --vlm-prompt, or name a planner that "
                f"asks a model ({', '.join(asking_planners())})."
            )
        spec = PlannerSpec(self.planner, model if asks else None)
        planner = make_spec_planner(spec, self.vlm.cache(), None)
        robot = None if self.robot == "none" else self.robot
        decider = FrameDecider(frame, planner, robot=robot, stages=self.stages)
        with announced_compilation(tell):
            decider.rehearse()
        answer = decider.decide(seed=self.seed, wanted=wanted, finder=finder)
        if self.out is not None:
            self.out.mkdir(parents=True, exist_ok=True)
            write_json(self.out / "decision.json", answer.to_dict())
            answer.save_pictures(self.out)
        if self.json:
            print_json(answer.to_dict())
        else:
            print(answer_text(answer))
        return 0 if answer.decision.object_id is not None else NO_CHOICE
