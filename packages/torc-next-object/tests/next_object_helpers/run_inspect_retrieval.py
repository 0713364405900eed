"""Runs torc_next_object/retrieval in the environment of inspect_ai, with a scripted model; prints what came of it.

python -m next_object_helpers.run_inspect_retrieval PROBLEM LOGS REPLY [REPLY ...]
"""

import json
import sys

from inspect_ai import eval as run_eval
from inspect_ai.model import ModelOutput, ModelUsage, get_model


def main(problem: str, logs: str, *replies: str) -> None:
    """The replies in turn, the last one again and again."""
    asked = []

    def answer(messages, tools, choice, config):
        content = messages[-1].content
        asked.append({"turns": len(messages), "kinds": [c.type for c in content], "text": content[-1].text})
        output = ModelOutput.from_content("mockllm/model", replies[min(len(asked), len(replies)) - 1])
        # Without it inspect_ai counts tokens itself, and fetches a table for that.
        output.usage = ModelUsage(input_tokens=10, output_tokens=5, total_tokens=15)
        return output

    model = get_model("mockllm/model", custom_outputs=answer)
    (log,) = run_eval(
        "torc_next_object/retrieval",
        model=model,
        task_args={"problems": problem, "max_picks": 4},
        log_dir=logs,
        display="none",
        log_format="json",
    )
    if log.status != "success":
        raise SystemExit(f"{log.status}: {log.error}")
    (sample,) = log.samples
    (score,) = sample.scores.values()
    metrics = {found.name: {k: m.value for k, m in found.metrics.items()} for found in log.results.scores}
    print(
        json.dumps(
            {
                "value": score.value,
                "end": score.answer,
                "asked": asked,
                "metrics": metrics,
                "facts": sample.metadata,
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
