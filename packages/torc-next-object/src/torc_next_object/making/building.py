"""Build a directory of rows from problems; an interrupted build resumes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from torc import InputError, load_problem
from torc.errors import PhysicsError
from torc.processes import open_pool
from torc_next_object.data.publishing import publish
from torc_next_object.data.tables import read_rows, write_rows, write_splits
from torc_next_object.making.known_values import KnownValues
from torc_next_object.making.rows import MakingConfig, RowMaker

ASIDE = ".rows"
Say = Callable[[str], None]


@dataclass(frozen=True)
class Making:
    """What rows are made of, and how.

    Attributes:
        problems: names or files.
        config: how rows are made.
        values: the file of known values; see `KnownValues`.
        workers: number of processes that share the work.
    """

    problems: Sequence[str]
    config: MakingConfig
    values: Path | None = None
    workers: int = 1


def build(making: Making, out: Path, most: int | None, say: Say) -> tuple[dict[str, int], int]:
    """Make the missing rows of the problems and write all rows; return the rows per split, and how many are new.

    Rows are kept in a directory beside `out`, each as it comes. Several processes may make a few more than `most`.
    Raises InputError if there is no row at all, or the directory holds another version of the questions.
    """
    config, aside = making.config, out.with_name(out.name + ASIDE)
    aside.mkdir(parents=True, exist_ok=True)
    for file in sorted(aside.glob("*.parquet"))[:1]:
        before = read_rows(file)[0].questions
        if before != config.questions:
            raise InputError(
                f"'{aside}' holds questions of version {before}, not {config.questions}. Choose another --out."
            )
    skipped, new = list[str](), 0
    for why_none in _made(making, aside, say):
        if why_none is not None:
            skipped.append(why_none)
            continue
        new += 1
        if most is not None and new >= most:
            break
    if not any(aside.glob("*.parquet")):
        why = "" if config.most_looks else "No values are known: let looks search for them. "
        raise InputError(f"No decision could be made of these problems. {why}{' '.join(skipped)}")
    rows = read_rows(aside)
    splits = write_splits(out, rows)
    publish(out, rows, config.hidden)
    return splits, new


def _made(making: Making, aside: Path, say: Say) -> Iterator[str | None]:
    """Yield None for each new row, which is written by then; the reason for each problem that gave none."""
    problems = range(len(making.problems))
    if making.workers == 1:
        maker = RowMaker(making.config, KnownValues(making.values))
        for index in problems:
            yield from _of_problem(making, index, aside, maker, say)
        return
    with open_pool(making.workers) as pool:
        running = [pool.submit(_in_worker, making, index, aside) for index in problems]
        try:
            for done in as_completed(running):
                found, lines = done.result()
                for line in lines:
                    say(line)
                yield from found
        finally:
            for future in running:
                future.cancel()


def _in_worker(making: Making, index: int, aside: Path) -> tuple[list[str | None], list[str]]:
    lines = list[str]()
    maker = _maker(making.config, making.values)
    return list(_of_problem(making, index, aside, maker, lines.append)), lines


@cache
def _maker(config: MakingConfig, values: Path | None) -> RowMaker:
    """Make one per worker."""
    return RowMaker(config, KnownValues(values))


def _of_problem(making: Making, index: int, aside: Path, maker: RowMaker, say: Say) -> Iterator[str | None]:
    config, problem = making.config, load_problem(making.problems[index])
    place = f"[{index + 1}/{len(making.problems)}]"
    done = aside / f"{maker.scene(problem)}-{config.per_problem}.done"
    if done.exists():
        return
    try:
        for row in maker.rows(problem, lambda key: (aside / f"{key}.parquet").exists()):
            write_rows(aside / f"{row.id}.parquet", [row])
            # A problem's name may reveal the seed that the host keeps.
            name = "a problem" if config.hidden else problem.name
            say(
                f"{place} {name}, {row.picks_taken} gone: {len(row.numbers)} choices, best {row.best_value:.2f} picks, "
                f"random {row.random_value:.2f}"
            )
            yield None
    except (InputError, PhysicsError) as error:
        say(f"{place} left out: {error}")
        yield str(error)
    # Decisions whose values are not known yet are still to come.
    if config.most_looks > 0:
        done.touch()
