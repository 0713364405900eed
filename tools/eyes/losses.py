"""What perception cost in recorded trials: ids kept and lost, the target known or mistaken, masks that were wrong, and
for every trial that did not go well what had gone wrong with its masks."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from torc.benchmark.reading import read_tables
from torc.benchmark.rows import TrialRow
from torc.episode.held import SURE
from torc.records import TARGET_ID
from torc.trials.recorded import RecordedPick, picks_of, read_events

_WENT_WELL = ("retrieved", "removed")


@dataclass
class Losses:
    """Counts over the looks of some trials.

    Attributes:
        kept, renamed, switched: objects in two looks in a row under the same id; under a new one; under one that had
            been another object's.
        objects: objects that were seen, look by look; merged, split, missed: of those, by `MaskFaults`.
        target_known, target_unknown: looks at a target that has a mask.
        target_mistaken: looks in which another object was taken for the target.
        held: what was lifted and looked at: whether it was the target, whether it was taken for it.
        unnoticed: targets that were brought unrecognised.
        ends: how trials ended.
        failures: per failed pick what had been wrong with the mask of the object that was to be picked.
    """

    kept: int = 0
    renamed: int = 0
    switched: int = 0
    objects: int = 0
    merged: int = 0
    split: int = 0
    missed: int = 0
    target_known: int = 0
    target_unknown: int = 0
    target_mistaken: int = 0
    picks: int = 0
    held: Counter[tuple[bool, bool]] = field(default_factory=Counter)
    unnoticed: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    failures: Counter[str] = field(default_factory=Counter)

    def add_looks(self, picks: Sequence[RecordedPick]) -> None:
        """Counts one trial's looks and picks."""
        before: dict[int, int] = {}
        owners: dict[int, int] = {}
        for pick in picks:
            looked = pick.looked
            now = {true: int(own) for own, true in looked.true_ids.items() if true >= 0}
            faults = looked.mask_faults
            self.objects += len(now) + len(faults.missed)
            self.merged, self.split = self.merged + len(faults.merged), self.split + len(faults.split)
            self.missed += len(faults.missed)
            for true, own in now.items():
                if true not in before:
                    continue
                same = own == before[true]
                others = owners.get(own, true) != true
                self.kept, self.renamed = self.kept + same, self.renamed + (not same and not others)
                self.switched += not same and others
            owners |= {own: true for true, own in now.items()}
            before = before | now
            known = now.get(TARGET_ID)
            if known is not None:
                sure = looked.target_visible and known == looked.target_id
                self.target_known, self.target_unknown = (
                    self.target_known + sure,
                    self.target_unknown + (not sure),
                )
            self.target_mistaken += (
                looked.target_visible and looked.true_ids.get(str(looked.target_id), TARGET_ID) != TARGET_ID
            )
            self._add_pick(pick)

    def _add_pick(self, pick: RecordedPick) -> None:
        done, faults = pick.executed, pick.looked.mask_faults
        if done is None:
            return
        self.picks += 1
        if done.target_p is not None and done.held_id is not None:
            self.held[done.held_id == TARGET_ID, done.target_p >= SURE] += 1
        self.unnoticed += done.result == "retrieved" != done.felt_result
        if done.result in _WENT_WELL:
            return
        meant = done.meant_id
        why = "masks were right"
        for name in ("merged", "split", "missed"):
            if meant in getattr(faults, name):
                why = name
        self.failures[f"{done.result}, {'no object' if meant < 0 else why}"] += 1


def losses_of(rows: Iterable[TrialRow]) -> Losses:
    """Counts over completed trials."""
    found = Losses()
    for row in rows:
        if row.completed:
            found.add_looks(picks_of(read_events(row.directory / "events.jsonl")))
            found.ends[row.end] += 1
    return found


def print_losses(directories: Sequence[Path]) -> None:
    """Prints what was lost, planner by planner (and condition by condition where those were swept)."""
    table = read_tables(directories)
    for planner in table.planners:
        found = losses_of(table.of(planner))
        pairs = max(found.kept + found.renamed + found.switched, 1)
        objects, looks = max(found.objects, 1), max(found.target_known + found.target_unknown, 1)
        print(f"## {planner}: {sum(found.ends.values())} trials")
        print(
            f"ids kept {found.kept / pairs:.4f}, renamed {found.renamed / pairs:.4f}, of {pairs} pairs of looks;"
        )
        print(f"switched {found.switched / pairs:.4f}")
        shares = {name: getattr(found, name) / objects for name in ("merged", "split", "missed")}
        told = ", ".join(f"{name} {share:.4f}" for name, share in shares.items())
        print(f"of {objects} objects, look by look: {told}")
        print(f"target with a mask known in {found.target_known / looks:.4f} of {looks} looks,")
        print(f"another object taken for it in {found.target_mistaken} looks")
        if found.held:
            (known, unknown), (taken, others) = (
                [found.held[target, sure] for sure in (True, False)] for target in (True, False)
            )
            print(
                f"in the hand: targets known {known}, not known {unknown}; others taken for it {taken}, not {others};"
            )
            print(f"targets brought unrecognised {found.unnoticed}")
        print("ends:", ", ".join(f"{name} {n}" for name, n in found.ends.most_common()))
        failed = ", ".join(f"{name} {n}" for name, n in found.failures.most_common())
        print(f"{found.picks} picks; failed: {failed}\n")
