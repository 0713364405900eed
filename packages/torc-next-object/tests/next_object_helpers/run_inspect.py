"""Runs in the environment of inspect_ai: a task on a data set with recorded replies; prints what it scored as JSON.

python -m next_object_helpers.run_inspect TASK DATA REPLIES.json LOGS [EPOCHS]
"""

import json
import sys
from pathlib import Path

from inspect_ai import eval as run_eval
from inspect_ai.model import ModelOutput, ModelUsage, get_model

from torc.io.pictures import data_url
from torc_next_object.data.opening import open_rows
from torc_next_object.prompting import prompt_text


def main(task: str, data: str, replies: str, logs: str, epochs: str = "1") -> None:
    """Every question is answered by the reply that is recorded for its text and pictures."""
    recorded = json.loads(Path(replies).read_text())
    variant = task.rpartition("_")[2]
    by_question = {}
    for row in open_rows(data):
        by_question[prompt_text(row, variant), data_url(row["image"])] = recorded[row["id"]]
    asked = []

    def answer(messages, tools, choice, config):
        content = messages[-1].content
        text = next(c.text for c in content if c.type == "text")
        asked.append([c.type for c in content])
        output = ModelOutput.from_content("mockllm/model", by_question[text, content[0].image])
        output.usage = ModelUsage(input_tokens=10, output_tokens=5, total_tokens=15)
        return output

    model = get_model("mockllm/model", custom_outputs=answer)
    (log,) = run_eval(
        task,
        model=model,
        task_args={"data": data},
        log_dir=logs,
        display="none",
        epochs=int(epochs),
        log_format="json",
    )
    if log.status != "success":
        raise SystemExit(f"{log.status}: {log.error}")
    (score,) = log.results.scores
    samples = {s.id: dict(next(iter(s.scores.values())).value) for s in log.samples}
    answers = {s.id: next(iter(s.scores.values())).answer for s in log.samples}
    metrics = {name: found.value for name, found in score.metrics.items()}
    told = {"scorer": score.name, "metrics": metrics, "samples": samples, "answers": answers}
    print(json.dumps(told | {"task": log.eval.task, "metadata": log.eval.metadata, "asked": asked}))


if __name__ == "__main__":
    main(*sys.argv[1:])
