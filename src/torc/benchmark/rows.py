"""Trials of bench, run and human as rows of a table: a row per trial, with its picks."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from torc.pipeline.planners import is_reference
from torc.pipeline.state import EndReason
from torc.records import PickResult
from torc.specs.trial import SIMULATED

REAL = "real"
"""Category of trials on a real robot."""
_FOUND_ABSENT = (EndReason.GAVE_UP, EndReason.NOTHING_LEFT)
_WENT_WELL = (PickResult.RETRIEVED, PickResult.REMOVED)


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
    result: str
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
        return PickResult(self.result).grasp_tried

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
    directory: Path
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
    def cell(self) -> tuple[str, str, int]:
        """Its place in the table."""
        return self.planner, self.problem, self.seed

    @property
    def title(self) -> str:
        """What was played, in words."""
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

    @property
    def has_place(self) -> bool:
        """True if the trials share a directory that a viewer can be given."""
        whole = self.root.resolve()
        return whole != whole.parent

    @property
    def view_command(self) -> str:
        """The command that shows the trials in a browser; "" if they share no directory but the root of the disk."""
        if not self.has_place:
            return ""
        return f"torc view {shlex.quote(str(self.root))}"

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
