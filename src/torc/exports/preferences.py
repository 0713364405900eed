"""Preference pairs: where ORACLE or a person chose otherwise than another planner at the same look."""

from collections.abc import Iterable, Iterator

from torc.exports.answers import PROMPT, answer_text, chosen_object, prompt_text
from torc.exports.folders import Row
from torc.exports.selection import EXPERTS, Source, split_of, succeeded

_State = tuple[str, int, str, tuple[int, ...]]
_Choices = dict[int, tuple[Source, int]]
"""Chosen object -> the first trial and pick that chose it."""


def preference_rows(sources: Iterable[Source], test_share: float) -> Iterator[Row]:
    """A row per look, expert's choice and other planner's choice that differ.

    The same look is: same problem, seed, digest of what the camera and the grasp planner gave, and graspable objects;
    only trials with the same picks so far come to that. An expert's pick counts where it brought the object out, in a
    trial that retrieved the target; another planner's counts always, as long as it named an object in the picture.
    """
    experts: dict[_State, _Choices] = {}
    others: dict[_State, _Choices] = {}
    for source in sources:
        expert = source.planner in EXPERTS
        for number, pick in enumerate(source.trial.picks):
            chosen = chosen_object(source.trial, number)
            if chosen is None or not pick.looked.digest:
                continue
            if expert and not (source.retrieved and succeeded(pick)):
                continue
            state = (source.problem, source.trial.spec.seed, pick.looked.digest, pick.looked.graspable)
            (experts if expert else others).setdefault(state, {}).setdefault(chosen, (source, number))
    for state, choices in experts.items():
        rejected = others.get(state, {})
        for good, (source, number) in choices.items():
            for bad, (other, other_number) in rejected.items():
                if bad not in choices:
                    yield _row(source, number, good, other, other_number, bad, test_share)


def _row(
    source: Source, number: int, good: int, other: Source, other_number: int, bad: int, test_share: float
) -> Row:
    return Row(
        split=split_of(source.problem, test_share),
        problem=source.problem,
        name=f"{source.problem}-{source.key}-{number:02d}-{good}-{bad}",
        picture=source.trial.picture(number),
        facts={
            "pick": number,
            "prompt": prompt_text(source.trial, number),
            "chosen": answer_text(source.trial, number),
            "rejected": answer_text(other.trial, other_number),
            "prompt_name": PROMPT,
            "chosen_id": good,
            "rejected_id": bad,
            "chosen_by": source.trial.spec.planner.name,
            "rejected_by": other.trial.spec.planner.name,
            "expert": source.trial.spec.planner.expert,
            "seed": source.trial.spec.seed,
        },
    )
