"""`torc perception`: how well objects are found in pictures with known masks."""

import csv
from dataclasses import astuple, dataclass, field, fields
from pathlib import Path
from typing import Annotated, Literal

import tyro

from torc.cli.commands import Group
from torc.cli.printing import print_json, tell
from torc.errors import InputError
from torc.specs.conditions import PipelineSpec

_SHOWN = 12
"""Number of the worst pictures in worst.png."""


@dataclass(frozen=True)
class EvaluateCommand:
    """Measure masks on a data set that you have: OCID, OSD, GraspClutter6D, or frames of your own with labels.

    Prints overlap and boundary precision, recall and F, the share of objects with F of at least .75, and merges, splits
    and missed objects: the measures of the OCID and OSD benchmarks, averaged over pictures.
    """

    data: tyro.conf.Positional[Path]
    """Directory of the data set."""
    layout: Literal["ocid", "osd", "graspclutter6d", "frames"] = "frames"
    """How its files are arranged."""
    every: int = 1
    """Every so manieth picture."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for scores.csv (a row per picture) and worst.png (the worst pictures, true masks, found masks)."""
    json: Annotated[bool, tyro.conf.arg(help="Print JSON instead of a table.")] = False
    stages: PipelineSpec = field(default_factory=lambda: PipelineSpec(perception="embedded"))

    def run(self) -> int:
        from torc.brain.seeing import judge
        from torc.drawing.marking import mask_comparison
        from torc.io.pictures import write_png
        from torc.perception.scoring import MaskScore, mean_score
        from torc.pipeline.frames.annotated import annotated_pictures

        if self.every < 1:
            raise InputError("--every is at least 1.")
        found = annotated_pictures(self.data, self.layout)[:: self.every]
        judged = []
        for i, (name, read) in enumerate(found):
            try:
                picture = read()
                judged.append((picture, judge(picture, self.stages)))
            except InputError as error:
                tell(f"{name}: left out: {error}")
            if (i + 1) % 20 == 0:
                tell(f"{i + 1} of {len(found)} pictures")
        if not judged:
            raise InputError("None of the pictures could be used; the reasons are above.")
        mean = mean_score([j.score for _, j in judged])
        if self.out is not None:
            self.out.mkdir(parents=True, exist_ok=True)
            with (self.out / "scores.csv").open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(["picture", *(f.name for f in fields(MaskScore))])
                writer.writerows([p.name, *(round(v, 4) for v in astuple(j.score))] for p, j in judged)
            worst = sorted(judged, key=lambda pair: pair[1].score.overlap_f)[:_SHOWN]
            pictures = [(picture.observation.rgb, picture.truth, j.found) for picture, j in worst]
            write_png(self.out / "worst.png", mask_comparison(pictures))
        numbers = {f.name: round(v, 4) for f, v in zip(fields(MaskScore), astuple(mean))}
        if self.json:
            print_json({"pictures": len(judged), "left_out": len(found) - len(judged), **numbers})
        else:
            print(f"{len(judged)} of {len(found)} pictures, --perception {self.stages.perception}")
            print("\n".join(f"  {name:<12} {value:.3f}" for name, value in numbers.items()))
        return 0


PERCEPTION = Group(
    "Finding objects in pictures.",
    {"evaluate": ("how well masks agree with true ones, on a data set of yours", EvaluateCommand)},
)
