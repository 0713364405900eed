"""What is decided for a frame, and what it rests on."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from torc.perception.marking import mark_image
from torc.pipeline.look import Look
from torc.records import Decision
from torc.records.files import write_png
from torc.records.serialization import to_plain
from torc.task_planning.drawing import draw_decision


@dataclass(frozen=True)
class Answer:
    """The decision for a frame.

    Attributes:
        decision: of the task planner, in torc's ids (0 is the target).
        look: all that the decision rests on; `look.context.volume` goes into the next call.
        labels: the frame's own label of each id.
        names: the frame's name of each id that has one.
    """

    decision: Decision
    look: Look
    labels: Mapping[int, int]
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def label(self) -> int | None:
        """The object to pick next, as the frame labels it; None if there is no choice."""
        return None if self.decision.object_id is None else self.labels[self.decision.object_id]

    @property
    def left_out(self) -> tuple[int, ...]:
        """Labels of the frame that show too little to be taken for objects: too few pixels, or readings of depth."""
        return tuple(
            sorted(label for k, label in self.labels.items() if k not in self.look.context.scene.ids)
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-compatible: the choice, why, and per object its grasps and what blocks them.

        `label` and `left_out` are labels of the frame; everything else speaks of torc's ids, and `objects` tells the
        label of each.
        """
        context = self.look.context
        report = context.report
        objects = [
            {
                "id": k,
                "label": self.labels[k],
                **({"name": self.names[k]} if k in self.names else {}),
                "pixels": context.scene.object(k).pixel_count,
                "valid_grasps": int(report.valid_total[i]),
                "blocked_by": {str(b): int(n) for b, n in zip(report.object_ids, report.blocking[i]) if n},
                "hides_m3": round(context.volume.hidden_volume_m3(k), 6),
            }
            for i, k in enumerate(report.object_ids)
        ]
        return {
            "label": self.label,
            **to_plain(self.decision),
            "target_visible": context.scene.target_id is not None,
            "objects": objects,
            "left_out": list(self.left_out),
            "seconds": {name: round(s, 4) for name, s in self.look.seconds.items()},
        }

    def save_pictures(self, directory: Path) -> None:
        """Write seen.png (the marked image) and, if the planner has one, graph.png."""
        chosen = self.decision.object_id
        write_png(directory / "seen.png", mark_image(self.look.context.scene, highlight=chosen))
        graph = draw_decision(self.decision)
        if graph is not None:
            write_png(directory / "graph.png", graph)
