"""Only the brain: one RGB-D frame with masks in, the next object and why out. No simulator, no robot needed.

>>> from torc.brain import decide_frame, load_frame              # doctest: +SKIP
>>> answer = decide_frame(load_frame("frame.npz"))               # doctest: +SKIP
>>> print(answer.label, answer.decision.reason)                  # doctest: +SKIP
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from torc.errors import InputError
from torc.grasping.planner import GeometricGraspPlanner
from torc.occlusion.volume import empty_volume
from torc.perception.marking import mark_image
from torc.perception.privileged import LabelPerception
from torc.pipeline.frames import Frame, load_frame
from torc.pipeline.look import Look, Pipeline
from torc.pipeline.seeding import stage_rng
from torc.records import Decision, OcclusionVolume
from torc.records.serialization import to_plain
from torc.robots.description import RobotDescription, load_robot
from torc.scenes.workspace import Bin, Box, Workspace
from torc.task_planning.drawing import draw_graph
from torc.task_planning.graph import DependencyGraph
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import make_planner

__all__ = ["Answer", "decide_frame", "load_frame"]

DEFAULT_GRIPPER = "sda10f_2f85"


@dataclass(frozen=True)
class Answer:
    """The decision for a frame.

    Attributes:
        decision: of the task planner, in torc's ids (0 is the target).
        look: all that the decision rests on; `look.context.volume` goes into the next call.
        labels: the frame's own label of each id.
    """

    decision: Decision
    look: Look
    labels: dict[int, int]

    @property
    def label(self) -> int | None:
        """The object to pick next, as the frame labels it; None if there is no choice."""
        return None if self.decision.object_id is None else self.labels[self.decision.object_id]

    def to_dict(self) -> dict[str, Any]:
        """JSON-compatible: the choice, why, and per object its grasps and what blocks them."""
        context = self.look.context
        report = context.report
        objects = [
            {
                "id": k,
                "label": self.labels[k],
                "pixels": context.scene.object(k).pixel_count,
                "valid_grasps": int(report.valid_total[i]),
                "blocked_by": {str(b): int(n) for b, n in zip(report.object_ids, report.blocking[i]) if n},
                "hides_m3": round(context.volume.hidden_volume_m3(k), 6),
            }
            for i, k in enumerate(report.object_ids)
        ]
        decision = to_plain(self.decision)
        return {
            "label": self.label,
            **decision,
            "target_visible": context.scene.target_id is not None,
            "objects": objects,
            "seconds": {name: round(s, 4) for name, s in self.look.seconds.items()},
        }

    def text(self) -> str:
        """A few lines for people."""
        context = self.look.context
        target = "in sight" if context.scene.target_id is not None else "hidden"
        choice = "no choice" if self.label is None else f"pick object {self.label}"
        renamed = {k: label for k, label in self.labels.items() if k != label and k in context.scene.ids}
        lines = [
            f"{choice}: {self.decision.reason}",
            f"target {target}; {len(context.scene.objects)} objects in sight",
        ]
        probabilities = self.decision.evidence.get("probabilities", {})
        for object_id, p in sorted(probabilities.items(), key=lambda item: -item[1]):
            lines.append(f"  p({object_id}) = {p:.3f}")
        if renamed:
            pairs = ", ".join(f"{k} = label {label}" for k, label in sorted(renamed.items()))
            lines.append(f"numbers in reasons and pictures: {pairs}")
        return "\n".join(lines)

    def save_pictures(self, directory: Path) -> None:
        """Write seen.png (the marked image) and, if the planner has one, graph.png."""
        chosen = self.decision.object_id
        _write_png(directory / "seen.png", mark_image(self.look.context.scene, highlight=chosen))
        graph = self.decision.evidence.get("graph")
        if graph is not None:
            probabilities = self.decision.evidence.get("probabilities")
            picture = draw_graph(DependencyGraph.from_dict(graph), probabilities=probabilities, chosen=chosen)
            _write_png(directory / "graph.png", picture)


def decide_frame(
    frame: Frame,
    planner: TaskPlanner | None = None,
    *,
    robot: RobotDescription | str | None = None,
    volume: OcclusionVolume | None = None,
    seed: int = 0,
) -> Answer:
    """Which object to pick next in a frame.

    Args:
        frame: the snapshot with masks, see `load_frame`.
        planner: task planner; DG-SELECT by default.
        robot: whose reach counts (a description, or its name or path); None checks only the gripper (a Robotiq
            2F-85) and takes every pose as reachable.
        volume: the occlusion volume after the frame before, None for the first frame.
        seed: decides all random draws.
    """
    planner = planner or make_planner("dg-select")
    description = load_robot(robot) if isinstance(robot, str) else robot
    gripper = description.gripper if description is not None else load_robot(DEFAULT_GRIPPER).gripper
    pipeline = Pipeline(
        perception=LabelPerception(),
        grasp_planner=GeometricGraspPlanner(gripper, frame.support_z_m),
        robot=description if description is not None else gripper,
        workspace=_workspace(frame, with_robot=description is not None),
    )
    before = volume if volume is not None else empty_volume(frame.grid)
    look = pipeline.look(frame.observation, before, target_description=frame.target_description, seed=seed)
    decision = planner.decide(look.context, stage_rng(seed, 0, "decide"))
    if decision.object_id is not None and decision.object_id not in look.context.scene.ids:
        raise InputError(
            f"Task planner '{planner.name}' named object {decision.object_id}, which is not in sight."
        )
    return Answer(decision, look, dict(frame.labels))


def _workspace(frame: Frame, *, with_robot: bool) -> Workspace:
    """The frame's support surface as the table; torc's own table only where its robot is meant too."""
    if with_robot:
        return Workspace(grid=frame.grid)
    # A workspace has a bin; here it is out of everything's way.
    nowhere = Bin(center=(0.0, 0.0, -100.0))
    (x, y, _), (dx, dy, _) = (
        0.5 * (frame.grid.upper + frame.grid.origin),
        frame.grid.upper - frame.grid.origin,
    )
    table = Box(
        "table", (float(x), float(y), frame.support_z_m - 0.05), (float(dx) + 0.4, float(dy) + 0.4, 0.10)
    )
    return Workspace(table=table, bin=nowhere, grid=frame.grid)


def _write_png(path: Path, rgb: np.ndarray) -> None:
    cv2.imwrite(str(path), cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
