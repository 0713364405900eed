"""Trials of bench, run and human as rows of a table, and the table's files.

The files, a CSV of trials and one of picks, are small enough to keep without the trials, and hold everything that a
report counts. With pyarrow they are also written as Parquet.
"""

import csv
import io
import shlex
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, TypeAdapter

from torc.errors import InputError
from torc.io.reading import read_plain_text
from torc.pipeline.planners import is_reference
from torc.pipeline.state import EndReason
from torc.records import PickResult
from torc.specs.trial import SIMULATED

TRIALS_FILE, PICKS_FILE = "trials.csv", "picks.csv"
_KEY = ("planner", "problem", "seed")
_MAY_BE_UNKNOWN = ("unseen_kind", "p", "vlm_calls", "tokens_sent", "tokens_written", "vlm_cost")
_MAX_BYTES = 512 * 2**20
REAL = "real"
"""Category of trials on a real robot."""
_FOUND_ABSENT = (EndReason.GAVE_UP, EndReason.NOTHING_LEFT)
_GRASP_TRIED = frozenset(result for result in PickResult if result.grasp_tried)
_WENT_WELL = (PickResult.RETRIEVED, PickResult.REMOVED)
_Row = TypeVar("_Row")


def _below(directory: Path) -> Path:
    """Refuse directories outside the table's own: tables may come from strangers."""
    if directory.is_absolute() or ".." in directory.parts:
        raise ValueError(f"The directory '{directory}' leads elsewhere")
    return directory


@dataclass(frozen=True)
class PickRow:
    """One attempt. Times are wall times except `robot_s`, which is on the robot's clock.

    Attributes:
        result: a value of `PickResult`.
        object_id: the object to be picked; -1 for none.
        attempts: how often the planner's model or person was asked.
        grasps_s: from the image to the valid grasps.
        dropped: objects other than the target that fell.
        unseen_kind: the grasp model was never trained on that kind of object; None if unknown.
        detail: a sentence for people.
        p: the probability that the grasp was given, of delivering the object; None without a plan, or not recorded.
    """

    pick: int
    result: Annotated[str, AfterValidator(PickResult)]
    object_id: int
    attempts: int
    decision_s: float
    grasps_s: float
    motions_s: float
    robot_s: float
    dropped: int
    held: bool
    unseen_kind: bool | None
    detail: str
    p: float | None = None

    @property
    def planning_s(self) -> float:
        """Planning time of the pick without the decision: grasps and motions."""
        return self.grasps_s + self.motions_s

    @property
    def grasp_tried(self) -> bool:
        """True if the robot went for the grasp."""
        return self.result in _GRASP_TRIED

    @property
    def delivered(self) -> bool:
        """True if the object was put into the bin."""
        return self.result in _WENT_WELL


@dataclass(frozen=True)
class TrialRow:
    """One trial. Fields after `error` are meaningful only if the status is "completed".

    Attributes:
        id: of the plan, "" for trials that no `torc bench` played.
        planner: its label, followed by the expert.
        status: completed, errored, interrupted, or missing: planned, but not played yet.
        held_target: the paper's own rule of success; `retrieved`: the target was delivered.
        max_picks: the budget.
        digest: of the problem as it was played, see `problem_fingerprint`; "" if unknown.
        conditions: robot, grasp planner, noise where they differ from the defaults, see `Conditions`.
        participant: its planner saw what planners see. Else it is a reference.
        bound: how sure ORACLE is that no planner can do with less, see `Bound`; "" if unknown.
        absent: the target is not on the table, so that giving up is right.
        vlm_calls: replies of the model that the planner asked; None if it asks none, or that is not recorded.
        tokens_sent, tokens_written, vlm_cost: of all those; None if a reply lacked its count, or prices are unknown.
    """

    id: str
    directory: Annotated[Path, AfterValidator(_below)]
    problem: str
    category: str
    planner: str
    seed: int
    status: str
    cause: str = ""
    error: str = ""
    retrieved: bool = False
    held_target: bool = False
    end: str = ""
    picks: int = 0
    drops: int = 0
    max_picks: int = 15
    picked: tuple[PickRow, ...] = ()
    version: str = ""
    digest: str = ""
    conditions: str = ""
    participant: bool = True
    bound: str = ""
    absent: bool = False
    vlm_calls: int | None = None
    tokens_sent: int | None = None
    tokens_written: int | None = None
    vlm_cost: float | None = None
    currency: str = ""

    @property
    def completed(self) -> bool:
        """True if the trial is scored."""
        return self.status == "completed"

    @property
    def played(self) -> bool:
        """False if the trial is planned, but not played yet."""
        return self.status != "missing"

    @property
    def real(self) -> bool:
        """True if it was played on a real robot."""
        return self.category == REAL

    @property
    def solved(self) -> bool:
        """True if the target was retrieved or, if it is absent, the planner gave up or cleared the table."""
        return self.end in _FOUND_ABSENT if self.absent else self.retrieved

    @property
    def cost(self) -> int:
        """Picks until the trial was solved; the whole budget if it never was."""
        return self.picks if self.solved else self.max_picks

    @property
    def spent(self) -> tuple[int, int]:
        return self.cost, self.drops

    @property
    def cell(self) -> tuple[str, str, int]:
        return self.planner, self.problem, self.seed

    @property
    def title(self) -> str:
        return f"{self.planner} on {self.problem}, seed {self.seed}"

    @property
    def failed_pick(self) -> PickRow | None:
        """The attempt to look at in a failed trial: the last that went wrong; None without attempts."""
        wrong = [p for p in self.picked if p.result not in _WENT_WELL] or self.picked
        return wrong[-1] if wrong else None


@dataclass(frozen=True)
class Table:
    """The trials of a benchmark, sorted by planner, problem and seed.

    Attributes:
        root: the directory that they were read from.
        rows: one per trial.
        left_out: directories that do not count, with the reason.
        beside: trials on a real robot, if there are simulated ones too: their scenes differ, so they are not compared.
    """

    root: Path
    rows: tuple[TrialRow, ...]
    left_out: tuple[tuple[Path, str], ...] = ()
    beside: tuple[TrialRow, ...] = ()

    @property
    def all_real(self) -> bool:
        """True if all compared trials were played on a real robot."""
        return all(row.real for row in self.rows)

    @property
    def on_robot(self) -> "Table":
        """Only the trials on a real robot."""
        return Table(self.root, self.beside or tuple(row for row in self.rows if row.real))

    @cached_property
    def has_place(self) -> bool:
        """True if the trials share a directory that a viewer can be given."""
        whole = self.root.resolve()
        return whole != whole.parent

    @property
    def view_command(self) -> str:
        """The command that shows the trials in a browser; "" if they share no directory but the root of the disk."""
        return f"torc view {shlex.quote(str(self.root))}" if self.has_place else ""

    @property
    def conditions(self) -> str:
        """The conditions of all trials as text; "" for the defaults."""
        return self.rows[0].conditions

    @property
    def planners(self) -> tuple[str, ...]:
        """Labels, in alphabetical order."""
        return tuple(dict.fromkeys(r.planner for r in self.rows))

    @property
    def problems(self) -> tuple[str, ...]:
        """Names, in alphabetical order."""
        return tuple(sorted({r.problem for r in self.rows}))

    def of(self, planner: str, category: str | None = None) -> list[TrialRow]:
        """Return the trials of a planner, completed or not."""
        return [r for r in self.rows if r.planner == planner and category in (None, r.category)]

    def completed(self, planner: str, category: str | None = None) -> list[TrialRow]:
        """Return the scored trials of a planner."""
        return [r for r in self.of(planner, category) if r.completed]


def participant_by_name(label: str) -> bool:
    """True if a planner competes, judged by its label alone: for older tables, and trials without a result."""
    name, _, model = label.partition("[")
    is_person = label.partition(" ")[0] == "human"
    return not (is_reference(name) or model.startswith(SIMULATED) or is_person)


def trial_records(table: Table) -> list[dict[str, Any]]:
    """Return a flat record per trial, with its sums of seconds and picks."""
    plain = [f.name for f in fields(TrialRow) if f.name not in ("directory", "picked")]
    records = []
    for row in (*table.rows, *table.beside):
        tried = [p for p in row.picked if p.grasp_tried]
        sums = {
            "cost": row.cost,
            "decision_s": round(sum(p.decision_s for p in row.picked), 4),
            "planning_s": round(sum(p.planning_s for p in row.picked), 4),
            "grasps_tried": len(tried),
            "grasps_held": sum(p.held for p in tried),
            "grasps_delivered": sum(p.delivered for p in tried),
            "directory": row.directory.relative_to(table.root).as_posix(),
        }
        records.append({name: getattr(row, name) for name in plain} | sums)
    return records


def pick_records(table: Table) -> list[dict[str, Any]]:
    """Return a flat record per attempt of all completed trials."""
    return [
        {**{k: getattr(row, k) for k in _KEY}, **vars(pick)}
        for row in (*table.rows, *table.beside)
        for pick in row.picked
    ]


def write_tables(table: Table, directory: Path) -> None:
    """Write trials.csv and picks.csv, and both as Parquet if pyarrow is installed."""
    for name, records in ((TRIALS_FILE, trial_records(table)), (PICKS_FILE, pick_records(table))):
        if not records:
            continue
        path = directory / name
        with open(path, "w", newline="", encoding="utf-8") as f:
            writer = csv.DictWriter(f, fieldnames=list(records[0]))
            writer.writeheader()
            writer.writerows(records)
        with suppress(ImportError):
            import pyarrow as pa
            from pyarrow import parquet

            parquet.write_table(pa.Table.from_pylist(records), path.with_suffix(".parquet"))


def read_rows(directory: Path) -> list[TrialRow]:
    """Read what `write_tables` wrote.

    Raises InputError naming the row: a file is too large or was not written by it.
    """
    picked: dict[tuple[str, ...], list[PickRow]] = {}
    if (directory / PICKS_FILE).is_file():
        for key, pick in _records(directory / PICKS_FILE, PickRow):
            picked.setdefault(key, []).append(pick)
    return [
        replace(row, directory=directory / row.directory, picked=tuple(picked.get(key, ())))
        for key, row in _records(directory / TRIALS_FILE, TrialRow)
    ]


def _records(path: Path, kind: type[_Row]) -> Iterator[tuple[tuple[str, ...], _Row]]:
    """Yield the trial's key and the row, for each row."""
    text = read_plain_text(path, _MAX_BYTES, "the table of a benchmark")
    reader, adapter = csv.DictReader(io.StringIO(text, newline="")), TypeAdapter(kind)
    try:
        for record in reader:
            # An empty cell is empty text, unless the value may be unknown.
            values = {k: None if v == "" and k in _MAY_BE_UNKNOWN else v for k, v in record.items()}
            if kind is TrialRow:
                values.setdefault("participant", participant_by_name(record["planner"]))
            yield tuple(record[name] for name in _KEY), adapter.validate_python(values)
    except (csv.Error, KeyError, TypeError, ValueError) as error:
        problem = " ".join(str(error).split()[:20])
        where = f"{path}, line {reader.line_num}"
        raise InputError(f"{where}: {problem}. It was not written by `torc report`.") from None
