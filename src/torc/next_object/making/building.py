"""A directory of rows from problems, gone on with where it was interrupted."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from torc.errors import InputError, PhysicsError
from torc.next_object.data.publishing import publish
from torc.next_object.data.tables import read_rows, write_rows, write_splits
from torc.next_object.making.rows import RowMaker
from torc.next_object.schema import NextObjectRow
from torc.problems.problem import load_problem

ASIDE = ".rows"


@dataclass(frozen=True)
class Built:
    """Rows per split, how many were made now, and why problems gave none."""

    splits: dict[str, int]
    new: int
    skipped: tuple[str, ...]


def build(
    problems: Sequence[str],
    out: Path,
    maker: RowMaker,
    most: int | None,
    say: Callable[[str], None],
) -> Built:
    """Make what is missing of the problems' rows, at most `most` new ones, and write all that there are. Rows are kept
    in a directory beside `out`, each as it comes. Raises InputError where there is no row at all.
    """
    aside = out.with_name(out.name + ASIDE)
    aside.mkdir(parents=True, exist_ok=True)
    skipped, new = list[str](), 0
    for row in _new_rows(problems, aside, maker, skipped, say):
        write_rows(aside / f"{row.id}.parquet", [row])
        new += 1
        if most is not None and new >= most:
            break
    if not any(aside.glob("*.parquet")):
        raise InputError(f"No decision could be made of these problems. {' '.join(skipped)}")
    rows = read_rows(aside)
    splits = write_splits(out, rows)
    publish(out, rows, maker.config.hidden)
    return Built(splits, new, tuple(skipped))


def _new_rows(
    problems: Sequence[str],
    aside: Path,
    maker: RowMaker,
    skipped: list[str],
    say: Callable[[str], None],
) -> Iterator[NextObjectRow]:
    config = maker.config
    for number, file in enumerate(problems, start=1):
        problem = load_problem(file)
        done = aside / f"{maker.scene(problem)}-{config.per_problem}.done"
        if done.exists():
            continue
        try:
            for row in maker.rows(problem, lambda key: (aside / f"{key}.parquet").exists()):
                yield row
                # A problem's name may tell the seed that the host keeps.
                name = "a problem" if config.hidden else problem.name
                best, random = f"{row.best_value:.2f}", f"{row.random_value:.2f}"
                say(
                    f"[{number}/{len(problems)}] {name}, {row.picks_taken} gone: {len(row.numbers)} choices, "
                    f"best {best} picks, random {random}"
                )
        except (InputError, PhysicsError) as error:
            skipped.append(str(error))
            say(f"[{number}/{len(problems)}] left out: {error}")
        done.touch()
