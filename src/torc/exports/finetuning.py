"""Examples for supervised fine-tuning: the marked image, VLM-SELECT's prompt, and the answer that brought success."""

from collections.abc import Iterable, Iterator

from torc.exports.answers import PROMPT, answer_text, chosen_object, prompt_text
from torc.exports.folders import Row
from torc.exports.selection import Source, split_of, succeeded


def finetuning_rows(sources: Iterable[Source], every: bool, test_share: float) -> Iterator[Row]:
    """A row per pick that brought the chosen object out; per pick with an answer at all, if `every`."""
    for source in sources:
        trial = source.trial
        for number, pick in enumerate(trial.picks):
            chosen = chosen_object(trial, number)
            if chosen is None or not (every or succeeded(pick)):
                continue
            executed = pick.executed
            yield Row(
                split=split_of(source.problem, test_share),
                problem=source.problem,
                name=f"{source.problem}-{source.key}-{number:02d}",
                picture=trial.picture(number),
                facts={
                    "pick": number,
                    "prompt": prompt_text(trial, number),
                    "answer": answer_text(trial, number),
                    "prompt_name": PROMPT,
                    "object_id": chosen,
                    "planner": trial.spec.planner.name,
                    "expert": trial.spec.planner.expert,
                    "seed": trial.spec.seed,
                    "result": executed.result if executed is not None else "",
                    "drops": len(executed.dropped) if executed is not None else 0,
                    "retrieved": source.retrieved,
                },
            )
