"""A directory of rows from problems, gone on with where it was interrupted."""

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
class Built:
    """Rows per split, how many were made now, and why problems gave none."""

    splits: dict[str, int]
    new: int
    skipped: tuple[str, ...]


@dataclass(frozen=True)
class Making:
    """What rows are made of, and how: names or files of problems, the file of values that are known already (see
    `KnownValues`), and how many processes share the work.
    """

    problems: Sequence[str]
    config: MakingConfig
    values: Path | None = None
    workers: int = 1


def build(making: Making, out: Path, most: int | None, say: Say) -> Built:
    """Make what is missing of the problems' rows, at most `most` new ones, and write all that there are. Rows are kept
    in a directory beside `out`, each as it comes. Several processes may make a few more than `most`. Raises InputError
    where there is no row at all.
    """
    aside = out.with_name(out.name + ASIDE)
    aside.mkdir(parents=True, exist_ok=True)
    for file in sorted(aside.glob("*.parquet"))[:1]:
        before = read_rows(file)[0].questions
        if before != making.config.questions:
            raise InputError(
                f"'{aside}' holds questions of version {before}, not {making.config.questions}. Choose another --out."
            )
    count, skipped, new = len(making.problems), list[str](), 0
    orders = [
        _Order(file, f"[{number}/{count}] ", making.config, making.values, aside)
        for number, file in enumerate(making.problems, start=1)
    ]
    for why_none in _made(orders, making.workers, say):
        if why_none is not None:
            skipped.append(why_none)
            continue
        new += 1
        if most is not None and new >= most:
            break
    if not any(aside.glob("*.parquet")):
        why = "" if making.config.most_looks else "No values are known: let looks search for them. "
        raise InputError(f"No decision could be made of these problems. {why}{' '.join(skipped)}")
    rows = read_rows(aside)
    splits = write_splits(out, rows)
    publish(out, rows, making.config.hidden)
    return Built(splits, new, tuple(skipped))


@dataclass(frozen=True)
class _Order:
    """One problem: `place` begins each line about it."""

    problem: str
    place: str
    config: MakingConfig
    values: Path | None
    aside: Path


def _made(orders: Sequence[_Order], workers: int, say: Say) -> Iterator[str | None]:
    """None for each new row, which is written by then; a text for each problem that gave none, saying why."""
    if workers == 1:
        maker = RowMaker(orders[0].config, KnownValues(orders[0].values))
        for order in orders:
            yield from _of_problem(order, maker, say)
        return
    with open_pool(workers) as pool:
        running = [pool.submit(_in_worker, order) for order in orders]
        try:
            for done in as_completed(running):
                found, lines = done.result()
                for line in lines:
                    say(line)
                yield from found
        finally:
            for future in running:
                future.cancel()


def _in_worker(order: _Order) -> tuple[list[str | None], list[str]]:
    lines = list[str]()
    return list(_of_problem(order, _maker(order.config, order.values), lines.append)), lines


def _of_problem(order: _Order, maker: RowMaker, say: Say) -> Iterator[str | None]:
    config, aside = order.config, order.aside
    problem = load_problem(order.problem)
    done = aside / f"{maker.scene(problem)}-{config.per_problem}.done"
    if done.exists():
        return
    try:
        for row in maker.rows(problem, lambda key: (aside / f"{key}.parquet").exists()):
            write_rows(aside / f"{row.id}.parquet", [row])
            # A problem's name may tell the seed that the host keeps.
            name = "a problem" if config.hidden else problem.name
            best, random = f"{row.best_value:.2f}", f"{row.random_value:.2f}"
            say(
                f"{order.place}{name}, {row.picks_taken} gone: {len(row.numbers)} choices, best {best} picks, "
                f"random {random}"
            )
            yield None
    except (InputError, PhysicsError) as error:
        say(f"{order.place}left out: {error}")
        yield str(error)
    # Decisions whose values are not known yet are still to come.
    if config.most_looks > 0:
        done.touch()


@cache
def _maker(config: MakingConfig, values: Path | None) -> RowMaker:
    """One in each worker."""
    return RowMaker(config, KnownValues(values))
