"""Runs in the environment of lmms-eval: a task with recorded replies; prints what it scored as JSON.

python -m next_object_helpers.run_lmms_eval TASK INCLUDE_PATH REPLIES.json
"""

import json
import sys
from pathlib import Path

from lmms_eval.api.model import lmms
from lmms_eval.evaluator import simple_evaluate
from lmms_eval.tasks import TaskManager


class Recorded(lmms):
    """Answers with the reply that is recorded for a row."""

    def __init__(self, replies):
        super().__init__()
        self.replies, self.asked = replies, []

    def generate_until(self, requests):
        """One reply for each."""
        told = []
        for request in requests:
            context, _, visuals, doc_id, task, split = request.args
            doc = self.task_dict[task][split][doc_id]
            pictures = visuals(doc)
            self.asked.append({"id": doc["id"], "text": context, "sizes": [p.size for p in pictures]})
            told.append(self.replies[doc["id"]])
        return told

    def loglikelihood(self, requests):
        """No task here wants it."""
        raise NotImplementedError

    def generate_until_multi_round(self, requests):
        """No task here wants it."""
        raise NotImplementedError


def main(task: str, directory: str, replies: str) -> None:
    """Print the scores of one task."""
    model = Recorded(json.loads(Path(replies).read_text()))
    tasks = TaskManager(include_path=directory, include_defaults=False)
    found = simple_evaluate(model, tasks=[task], task_manager=tasks, batch_size=1, bootstrap_iters=0)
    scores = {k.split(",")[0]: v for k, v in found["results"][task].items()}
    print(json.dumps({"scores": scores, "asked": model.asked}, default=str))


if __name__ == "__main__":
    main(*sys.argv[1:])
