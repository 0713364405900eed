"""Export a directory of trials to a directory of data."""

import os
import shutil
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import torc
from torc.errors import InputError, UnknownNameError
from torc.exports.examples import EXPERTS, Source, finetuning_rows, preference_rows, select_trials, write_rows
from torc.io.numbers import take_numbers
from torc.io.results import check_place, claim, write_json

Format = Literal["sft", "pairs", "lerobot"]
FACTS = "export.json"


@dataclass(frozen=True)
class ExportSpec:
    """The request for an export. Raises InputError if it makes no sense.

    `every` also takes trials that did not retrieve the target, and picks that brought nothing out; `test_share` is the
    share of the problems in the test split. Without `planners` the trials of all count, but for sft only experts', if
    there are any and not `every`: a bad teacher retrieves the target, too, with more picks.
    """

    format: Format
    every: bool = False
    test_share: float = 0.2
    planners: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        take_numbers(self)
        if not 0.0 <= self.test_share <= 1.0:
            raise InputError(f"The test share is {self.test_share}; it is a share, from 0 to 1.")
        if self.planners and self.format == "pairs":
            raise InputError("Pairs are made of experts' choices and others': leave out --planner.")


def export_trials(root: Path, out: Path, spec: ExportSpec, overwrite: bool = False) -> dict[str, Any]:
    """Write the trials below `root` to the directory `out` as data; return a summary, as in export.json.

    Raises InputError: there is nothing to export, a trial cannot be read, or `out` cannot be written.
    """
    with _new_directory(out, overwrite) as directory:
        # A rejected choice is mostly in a trial that failed, so pairs consider all of them.
        sources = _chosen(list(select_trials(root, spec.every or spec.format == "pairs")), spec)
        if spec.format == "lerobot":
            from torc.exports.lerobot import write_lerobot  # its library is an extra's

            counts, used = write_lerobot(directory, sources, spec.test_share)
        else:
            sft = spec.format == "sft"
            rows = finetuning_rows(sources, spec.every) if sft else preference_rows(sources)
            counts, used = write_rows(directory, rows, spec.test_share)
        if not sum(counts.values()):
            raise InputError(f"Nothing in '{root}' can be exported. {_NOTHING[spec.format]}")
        trials = dict(sorted(Counter(source.planner for source in used).items()))
        facts = {"torc": torc.__version__, **asdict(spec), "examples": counts, "trials": trials}
        write_json(directory / FACTS, facts)
    return facts


@contextmanager
def _new_directory(out: Path, overwrite: bool) -> Iterator[Path]:
    """Provide a directory to fill; it is renamed to `out` when the block succeeds, and removed when it fails."""
    check_place(out, overwrite, FACTS, "export")
    aside = out.with_name(f".{out.name}.partial")
    with claim(aside, "lock", "unfinished export"):
        try:
            partial = aside / out.name
            partial.mkdir()
            yield partial
            if out.exists():
                os.replace(out, aside / "replaced")
            os.replace(partial, out)
        finally:
            shutil.rmtree(aside, ignore_errors=True)


def _chosen(sources: list[Source], spec: ExportSpec) -> list[Source]:
    """Return the trials of the named planners, else of experts; all if no expert played."""
    known = sorted({source.planner for source in sources})
    for name in spec.planners:
        if name not in known:
            raise UnknownNameError("planner of the trials to export", name, known)
    if not spec.planners and (spec.format != "sft" or spec.every):
        return sources
    return [s for s in sources if s.planner in (spec.planners or EXPERTS)] or sources


_NOTHING = {
    "sft": "Of trials that retrieved the target, picks that brought an object out are; --every takes all.",
    "pairs": "It takes trials of oracle or human, and of another planner, with the same problem and seed, in which "
    "they chose differently at the same look.",
    "lerobot": "It takes trials that were played with --trajectory and retrieved the target; --every takes all.",
}
