"""`torc export`: recorded trials as data for training."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from torc.cli.printing import print_json, printable, split_names


@dataclass(frozen=True)
class ExportCommand:
    """Turn recorded trials into data to train on.

    The format says for what:

      sft      a Hugging Face imagefolder for supervised fine-tuning: the marked
               image that a VLM would see, the prompt of vlm-select, and the
               answer that brought success, in the form that vlm-select reads;
               of oracle's and people's trials, if there are any
      pairs    the same with a chosen and a rejected answer: where oracle or a
               person chose otherwise than another planner at the same look of
               the same problem and seed
      lerobot  a LeRobotDataset v3 of the robot's motions and its camera, of
               trials played with --trajectory

    A split by problem: no problem is in both train and test, and further trials move none from one to the other.
    For example:

      torc run structured-03 --planner oracle --out runs/a
      torc export runs --format sft --out data
      python -c 'from datasets import load_dataset
      print(load_dataset("imagefolder", data_dir="data"))'
    """

    directory: tyro.conf.Positional[Path]
    """A trial (`torc run --out DIR`), or a directory with trials anywhere in it."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """The directory to make."""
    format: Literal["sft", "pairs", "lerobot"] = "sft"
    """What to make of the trials; see above."""
    every: bool = False
    """Also trials that did not retrieve the target, and picks that brought nothing out."""
    planner: Annotated[str, tyro.conf.arg(metavar="A,B,...")] = ""
    """Only the trials of these task planners, comma-separated. If not given: for sft those of oracle and people, if
    there are any; else all."""
    test_share: float = 0.2
    """Part of the problems that go to the test split."""
    overwrite: bool = False
    """Replace the output directory if it exists."""
    json: Annotated[bool, tyro.conf.arg(help="Print export.json instead of text.")] = False

    def run(self) -> int:
        from torc.exports.exporting import ExportSpec, export_trials

        spec = ExportSpec(self.format, self.every, self.test_share, split_names(self.planner))
        facts = export_trials(self.directory, self.out, spec, self.overwrite)
        if self.json:
            print_json(facts)
            return 0
        for split, count in facts["examples"].items():
            print(f"{split:5}  {count} examples")
        teachers = ", ".join(f"{n} of {printable(name)}" for name, n in facts["trials"].items())
        print(f"From trials: {teachers}.")
        print(f"Written to {self.out}")
        return 0
