"""The sample of torc-next-object that comes with torc: decisions of the shipped problems, chosen by rules alone.

torc next-object make --problems torc40,torc-hard --values results/next-object/values.jsonl --looks 0 --workers 2 \\
  --out shipped
python packages/torc-next-object/tools/next_object_sample.py shipped
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import numpy as np
import tyro

from torc.errors import InputError
from torc.problems.problem import load_problem
from torc.problems.sets import problem_names, set_of
from torc_next_object.data.checking import set_faults
from torc_next_object.data.opening import CAVEAT, SAMPLE_FILE, SAMPLE_ROWS
from torc_next_object.data.tables import read_rows
from torc_next_object.making.rows import MakingConfig, RowMaker
from torc_next_object.schema import NAME, PICTURES, NextObjectRow

FILE = Path(__file__).parents[1] / "src" / "torc_next_object" / SAMPLE_FILE
_SETS = ("torc40", "torc-hard")
_SPLIT = "test"


def chosen_decisions(
    rows: Sequence[NextObjectRow], families: Mapping[str, str], count: int, seed: int
) -> list[NextObjectRow]:
    """Choose one decision of each problem: families in turn, their problems in an order that is drawn. The target is
    out of sight in half of the decisions, as far as the problems have such ones. `families` are by scene; other rows do
    not count. Raises InputError where there are too few problems.
    """
    rng = np.random.default_rng(seed)
    by_scene: dict[str, list[NextObjectRow]] = {}
    for row in sorted(rows, key=lambda row: row.id):
        if row.split == _SPLIT and row.scene in families:
            by_scene.setdefault(row.scene, []).append(row)
    drawn = [list(by_scene)[i] for i in rng.permutation(len(by_scene))]
    queues = [
        [scene for scene in drawn if families[scene] == name] for name in sorted(set(families.values()))
    ]
    in_turn = [scene for scene in chain.from_iterable(zip_longest(*queues)) if scene is not None]
    if len(in_turn) < count:
        raise InputError(f"{count} decisions need as many problems; here are {len(in_turn)}.")
    chosen: list[NextObjectRow] = []
    for scene in in_turn[:count]:
        wanted = 2 * sum(row.target_hidden for row in chosen) <= len(chosen)
        fitting = [row for row in by_scene[scene] if row.target_hidden == wanted] or by_scene[scene]
        chosen.append(fitting[int(rng.integers(len(fitting)))])
    return chosen


def write_sample(rows: Sequence[NextObjectRow], path: Path) -> None:
    """Write rows in the form that `sample_rows` reads. The file's bytes depend on the rows alone."""
    with ZipFile(path, "w") as archive:
        lines = []
        for row in sorted(rows, key=lambda row: row.id):
            names = [f"{row.id}_target_{i}.jpg" for i, _ in enumerate(row.references, start=1)]
            pictures = {f"{row.id}.jpg": row.image, **dict(zip(names, row.references, strict=True))}
            for name, picture in pictures.items():
                archive.writestr(_entry(name, ZIP_STORED), picture)
            facts = {k: v for k, v in row.to_dict().items() if k not in PICTURES}
            lines.append(json.dumps(facts | {"image": f"{row.id}.jpg", "references": names}))
        archive.writestr(_entry(SAMPLE_ROWS, ZIP_DEFLATED), "\n".join(lines) + "\n")
        archive.writestr(_entry("README.md", ZIP_DEFLATED), _about(rows))


def _entry(name: str, compression: int) -> ZipInfo:
    """Return an entry without the time at which it was written."""
    entry = ZipInfo(name)
    entry.compress_type, entry.external_attr = compression, 0o644 << 16
    return entry


def _about(rows: Sequence[NextObjectRow]) -> str:
    hidden = sum(row.target_hidden for row in rows)
    return (
        f"# {NAME}: a sample\n\n{len(rows)} decisions of {len({row.scene for row in rows})} problems, all of the split "
        f"test of {NAME}; the target is out of sight in {hidden}. {CAVEAT} MIT licence.\n"
    )


def shipped_families() -> dict[str, str]:
    """By scene: the set of a shipped problem, and, of torc40, whether its objects stand in order or lie in a pile."""
    maker, found = RowMaker(MakingConfig()), dict[str, str]()
    for name in chain.from_iterable(map(problem_names, _SETS)):
        problem, of_set = load_problem(name), str(set_of(name))
        found[maker.scene(problem)] = f"{of_set} {problem.category}" if of_set == "torc40" else of_set
    return found


@dataclass(frozen=True)
class Command:
    """Choose the decisions and write the file that comes with torc."""

    directory: tyro.conf.Positional[Path]
    """What `torc next-object make` made of the shipped problems; others do not count."""
    count: int = 60
    seed: int = 0
    out: Path = FILE

    def run(self) -> None:
        """Choose, check, write. Raises InputError where a decision may not be published."""
        families = shipped_families()
        chosen = chosen_decisions(read_rows(self.directory), families, self.count, self.seed)
        faults = list(set_faults(chosen))
        if faults:
            raise InputError("; ".join(faults))
        write_sample(chosen, self.out)
        counts = {
            name: sum(families[r.scene] == name for r in chosen) for name in sorted(set(families.values()))
        }
        hidden = sum(row.target_hidden for row in chosen)
        print(f"{len(chosen)} decisions, the target out of sight in {hidden}; {counts}")
        print(f"{self.out}: {self.out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    try:
        tyro.cli(Command).run()
    except InputError as error:
        raise SystemExit(f"error: {error}") from None
