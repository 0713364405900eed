"""Runs in the environment of VLMEvalKit: its run.py on an exported task with recorded replies; prints what it scored.

python -m next_object_helpers.run_vlmevalkit RUN.PY TASK REPLIES.json WORK   (LMUData: what was exported)
"""

import json
import sys
from pathlib import Path

import pandas as pd
import vlmevalkit
from vlmeval.config import supported_VLM
from vlmeval.smp import LMUDataRoot
from vlmeval.vlm.base import BaseModel


class Recorded(BaseModel):
    """Answers with the reply that is recorded for the line that its first picture belongs to."""

    INTERLEAVE = True

    def __init__(self, replies, table):
        super().__init__()
        rows = [json.loads(row)["id"] for row in table["row"]]
        self.by_index = {str(index): replies[key] for index, key in zip(table["index"], rows)}
        self.asked = []

    def generate_inner(self, message, dataset=None):
        """One reply."""
        self.asked.append([part["type"] for part in message])
        picture = Path(message[0]["value"]).stem
        return self.by_index[picture.partition("_")[0]]


def main(script: str, task: str, replies: str, work: str) -> None:
    """Print the scores of one task."""
    table = pd.read_csv(Path(LMUDataRoot()) / f"{task}.tsv", sep="\t")
    model = Recorded(json.loads(Path(replies).read_text()), table)
    supported_VLM["recorded"] = lambda **_: model
    found = {}
    evaluate = vlmevalkit.TorcNextObject.evaluate

    def kept(self, *args, **options):
        found.update(evaluate(self, *args, **options))
        return found

    vlmevalkit.TorcNextObject.evaluate = kept
    sys.argv = ["vlmevalkit", script, "--data", task, "--model", "recorded", "--work-dir", work]
    vlmevalkit.main()
    print(json.dumps({"scores": found, "asked": model.asked}))


if __name__ == "__main__":
    main(*sys.argv[1:])
