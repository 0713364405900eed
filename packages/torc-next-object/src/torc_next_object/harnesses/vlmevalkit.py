"""The data set as a benchmark of VLMEvalKit: a copy of this file lies beside the TSV files that
`torc next-object export --harness vlmevalkit` writes. torc must be importable, without its other dependencies.

    export LMUData=DIR PYTHONPATH=DIR:VLMEvalKit
    python -m vlmevalkit VLMEvalKit/run.py --data TorcNextObject_image --model MODEL

The kit's list of benchmarks cannot be extended from outside, so this runs its run.py with the benchmark added.
"""

import json
import os
import runpy
import sys
from pathlib import Path
from typing import Any

import pandas
from vlmeval import dataset as benchmarks
from vlmeval.dataset.image_base import ImageBaseDataset
from vlmeval.smp import LMUDataRoot, load

from torc_next_object.prompting import VARIANTS
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answers

NAMES = tuple(f"TorcNextObject_{variant}" for variant in VARIANTS)
MEASURES = ("regret", "regret_low", "regret_high", "top1", "lost", "invalid")


class TorcNextObject(ImageBaseDataset):
    """Which object first: one question a line, pictures first."""

    TYPE = "VQA"
    # No judge reads the replies.
    DEFAULT_JUDGE = "exact_matching"

    @classmethod
    def supported_datasets(cls) -> list[str]:
        """Return a data set for each variant."""
        return list(NAMES)

    def load_data(self, dataset: str) -> Any:
        """Return the table in the kit's data folder. Raises FileNotFoundError."""
        path = Path(LMUDataRoot()) / f"{dataset}.tsv"
        if not path.is_file():
            raise FileNotFoundError(
                f"There is no {path}. `torc next-object export --harness vlmevalkit` writes it into LMUData."
            )
        return load(str(path))

    def evaluate(self, eval_file: str, **_: Any) -> dict[str, float | int | None]:
        """Score the replies in a file of the kit's. A question that the server did not answer counts as nothing."""
        # Of JSON the kit makes a list of lines.
        table = pandas.DataFrame(load(eval_file))
        replied = [
            (json.loads(row), str(reply))
            for row, reply in zip(table["row"], table["prediction"], strict=True)
            if not any(mark in str(reply) for mark in self.INFER_FAIL_MARKERS)
        ]
        scores = score_answers((row, read_number(reply, row["numbers"])) for row, reply in replied).to_dict()
        return {name: scores[name] for name in MEASURES} | {"not_answered": len(table) - len(replied)}

    @classmethod
    def report_primary_metric(cls, metrics: dict[str, Any] | None) -> dict[str, float | int]:
        """Return the regret; less is better."""
        found = (metrics or {}).get("regret")
        return {} if found is None else {"regret": found}


def register() -> None:
    """Add the benchmark to the kit's own."""
    if TorcNextObject not in benchmarks.DATASET_CLASSES:
        benchmarks.DATASET_CLASSES.append(TorcNextObject)
        benchmarks.SUPPORTED_DATASETS.extend(NAMES)


def main() -> None:
    """Run the kit's script, whose path comes first, with the arguments that follow."""
    register()
    sys.argv = sys.argv[1:]
    # A sheet of Excel would cut long replies off at their end, where the answer is.
    os.environ.setdefault("PRED_FORMAT", "json")
    runpy.run_path(sys.argv[0], run_name="__main__")


if __name__ == "__main__":
    main()
