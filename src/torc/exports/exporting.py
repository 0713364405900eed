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
from torc.exports.examples import Row, finetuning_rows, preference_rows, write_rows
from torc.exports.selection import EXPERTS, Source, select_trials
from torc.io.numbers import take_numbers
from torc.io.results import check_place, claim, write_json

Format = Literal["sft", "pairs", "lerobot"]
FACTS = "export.json"


@dataclass(frozen=True)
class ExportSpec:
    """The request for an export.

    Attributes:
        format: the kind of data.
        every: also take trials that did not retrieve the target, and picks that brought nothing out.
        test_share: share of the problems in the test split.
        planners: whose trials count. If empty all do, but for sft only experts', if there are any and not `every`: a
            bad teacher retrieves the target, too, with more picks.

    Raises:
        InputError: the share is invalid, or planners are named for pairs, which need experts and others.
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
    """Write the trials below `root` to `out` as data; return a summary, as in export.json.

    Args:
        root: a trial, or a directory with trials anywhere in it.
        out: the directory to make.
        spec: the request.
        overwrite: replace an earlier export in `out`.

    Raises:
        InputError: there is nothing to export, a trial cannot be read, or `out` cannot be written.
    """
    with _new_directory(out, overwrite) as directory:
        # A rejected choice is mostly in a trial that failed, so pairs consider all of them.
        sources = _chosen(list(select_trials(root, spec.every or spec.format == "pairs")), spec)
        if spec.format == "lerobot":
            from torc.exports.lerobot import has_motion, write_lerobot  # its library is an extra's

            used = {source.key: source for source in sources if has_motion(source)}
            counts = write_lerobot(directory, used.values(), spec.test_share)
        else:
            used = {}
            rows = (
                finetuning_rows(sources, spec.every, spec.test_share)
                if spec.format == "sft"
                else preference_rows(sources, spec.test_share)
            )
            counts = write_rows(directory, _noting(rows, used))
        if not sum(counts.values()):
            raise InputError(f"Nothing in '{root}' can be exported. {_NOTHING[spec.format]}")
        trials = dict(sorted(Counter(source.planner for source in used.values()).items()))
        facts = {"torc": torc.__version__, **asdict(spec), "examples": counts, "trials": trials}
        write_json(directory / FACTS, facts)
    return facts


def _noting(rows: Iterator[Row], used: dict[str, Source]) -> Iterator[Row]:
    """Yield the rows, and add the trials that they were made from to `used`."""
    for row in rows:
        used.update({source.key: source for source in row.sources})
        yield row


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
