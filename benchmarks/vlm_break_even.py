"""How good must a VLM be before it pays? The VLM planners with simulated VLMs of rising accuracy, beside the others.

    python -m benchmarks.vlm_break_even --out runs/vlm_break_even --problems validation --seeds 5 --workers 2

No model is asked: the simulated VLM answers from the simulator's truth, and each fact that it makes out is right with
the accuracy on the x axis (1/2 is knowing nothing; docs/vlm.md). Trials already in --out are not played again, so that
a stopped study goes on where it was. Left in --out: break_even.svg, break_even.png and table.md. 95 % intervals are
those of `torc report`, over the problems (trials of one problem are not independent).
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro

from benchmarks.break_even_figure import Line, Panel, draw
from benchmarks.processes import run_jobs
from torc.benchmark.intervals import Estimate, by_problem, difference, mean, share
from torc.episode.steps import EpisodeConfig

VLM_PLANNERS = ("vlm-select", "vlm-grasps", "vlm-fixes-dg")
BASELINES = ("dg-select", "random", "oracle")
MAX_PICKS = EpisodeConfig().max_picks
Statistic = Callable[[Sequence[dict]], Estimate]


def retrieved(rows: Sequence[dict]) -> Estimate:
    """Share of the trials with the target retrieved."""
    return share(*_sums(rows, [r["retrieved"] for r in rows]))


def with_no_drop(rows: Sequence[dict]) -> Estimate:
    """Share of the trials with the target retrieved and nothing dropped."""
    return share(*_sums(rows, [r["retrieved"] and r["drops"] == 0 for r in rows]))


def cost(row: dict) -> float:
    """Picks until the target was retrieved; the whole budget where it never was."""
    return float(row["picks"]) if row["retrieved"] else float(MAX_PICKS)


def picks(rows: Sequence[dict]) -> Estimate:
    """Mean picks to retrieval."""
    return mean(*_sums(rows, [cost(r) for r in rows]), largest=MAX_PICKS)


def drops(rows: Sequence[dict]) -> Estimate:
    """Mean drops of a trial."""
    return mean(*_sums(rows, [r["drops"] for r in rows]))


def lost(rows: Sequence[dict]) -> Estimate:
    """Share of the picks that were lost as no valid choice."""
    named = [r["outcomes"].count("no valid choice") for r in rows]
    return share(*by_problem([r["problem"] for r in rows], named, [r["picks"] for r in rows]))


PANELS: dict[str, tuple[Statistic, float | None]] = {
    "retrieved": (retrieved, 1.03),
    "retrieved, nothing dropped": (with_no_drop, 1.03),
    f"picks to retrieval ({MAX_PICKS} if never), mean": (picks, None),
}
"""Title -> what is drawn, and where its axis ends."""


@dataclass(frozen=True)
class Args:
    """Play what is missing, then draw the figure and write the table."""

    out: Path = Path("runs/vlm_break_even")
    """Directory of the trials, the figure and the table."""
    problems: str = "validation"
    """A set, problems or a directory of them, with commas between. Not what results are reported on."""
    seeds: int = 5
    """Seeds 0..N-1."""
    accuracies: tuple[float, ...] = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
    """Of the simulated VLM."""
    profiles: tuple[str, ...] = ("paper",)
    """Profiles beside them, drawn at the left."""
    planners: tuple[str, ...] = VLM_PLANNERS
    """Planners that ask it."""
    baselines: tuple[str, ...] = BASELINES
    """Planners to compare with, drawn as horizontal lines; differences are taken to the first."""
    workers: int = 2
    """Processes."""
    table_only: bool = False
    """Only draw and write what the trials that are there tell."""


@dataclass(frozen=True)
class Contender:
    """A planner, and the profile or accuracy of the simulated VLM that it asks, if it asks one."""

    planner: str
    quality: str = ""

    @property
    def vlm(self) -> str | None:
        """As for --vlm."""
        return f"simulated:{self.quality}" if self.quality else None

    @property
    def key(self) -> str:
        """Part of a trial's name."""
        return f"{self.planner}-simulated-{self.quality}" if self.quality else self.planner


def contenders(args: Args) -> tuple[Contender, ...]:
    """All that play: the baselines, then each planner by falling ignorance."""
    qualities = [*args.profiles, *(f"{accuracy:g}" for accuracy in args.accuracies)]
    asking = [Contender(planner, quality) for planner in args.planners for quality in qualities]
    return (*map(Contender, args.baselines), *asking)


def trials(args: Args) -> Iterator[tuple[str, Contender, int, Path]]:
    """All trials that the arguments ask for; each seed is complete before the next begins."""
    from torc.problems.sets import select_problems

    for seed in range(args.seeds):
        for problem in select_problems(args.problems):
            for contender in contenders(args):
                yield problem, contender, seed, args.out / f"{Path(problem).stem}-{contender.key}-{seed}"


def load(args: Args) -> list[dict]:
    """Results of all completed and errored trials that are there."""
    rows = []
    for problem, contender, seed, path in trials(args):
        if (path / "result.json").exists():
            result = json.loads((path / "result.json").read_text())
            rows.append({"problem": problem, "contender": contender, "seed": seed, **result})
    return rows


def table(rows: list[dict], args: Args) -> str:
    """A row per contender."""
    base = Contender(args.baselines[0])
    lines = [
        "| planner | VLM | trials | errored | retrieved | with no drop | picks to retrieval | mean drops "
        f"| picks lost as no valid choice | retrieved, less {base.planner}'s | picks, less its |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for contender in contenders(args):
        mine = [r for r in rows if r["contender"] == contender]
        done = _completed(mine)
        if not done:
            continue
        cells = [
            retrieved(done).text(),
            with_no_drop(done).text(),
            picks(done).text(1),
            drops(done).text(),
            lost(done).text(),
            *(("", "") if contender == base else gaps(rows, contender, base)),
        ]
        counts = f"{len(mine)} | {len(mine) - len(done)}"
        lines.append(f"| {contender.planner} | {contender.vlm or ''} | {counts} | {' | '.join(cells)} |")
    return "\n".join(lines)


def gaps(rows: list[dict], contender: Contender, base: Contender) -> tuple[str, str]:
    """Success and cost of one less that of the other, on the same problems and seeds."""
    more = _gap(rows, contender, base, lambda r: float(r["retrieved"]), 1.0)
    longer = _gap(rows, contender, base, cost, float(MAX_PICKS))
    return more.text(), longer.text(1)


def _gap(
    rows: list[dict],
    contender: Contender,
    base: Contender,
    value: Callable[[dict], float],
    largest: float,
) -> Estimate:
    ours, theirs = (
        {(r["problem"], r["seed"]): r for r in _completed(r for r in rows if r["contender"] == c)}
        for c in (contender, base)
    )
    shared = sorted(ours.keys() & theirs.keys())
    apart = [value(ours[key]) - value(theirs[key]) for key in shared]
    return difference(*_sums([ours[key] for key in shared], apart), largest=largest)


def panels(rows: list[dict], args: Args) -> list[Panel]:
    """What is drawn: per statistic a line per planner over the accuracies, and the baselines."""
    found = []
    for title, (statistic, top) in PANELS.items():
        lines = tuple(
            Line(
                planner,
                tuple(_points(rows, args, planner, statistic)),
                tuple(_profiles(rows, args, planner, statistic)),
            )
            for planner in args.planners
        )
        levels = {b: _level(rows, Contender(b), statistic) for b in args.baselines}
        found.append(Panel(title, lines, {b: level for b, level in levels.items() if level is not None}, top))
    return found


def _points(
    rows: list[dict], args: Args, planner: str, statistic: Statistic
) -> Iterator[tuple[float, Estimate]]:
    for accuracy in args.accuracies:
        level = _level(rows, Contender(planner, f"{accuracy:g}"), statistic)
        if level is not None:
            yield accuracy, level


def _profiles(
    rows: list[dict], args: Args, planner: str, statistic: Statistic
) -> Iterator[tuple[str, Estimate]]:
    for profile in args.profiles:
        level = _level(rows, Contender(planner, profile), statistic)
        if level is not None:
            yield profile, level


def _level(rows: list[dict], contender: Contender, statistic: Statistic) -> Estimate | None:
    done = _completed(r for r in rows if r["contender"] == contender)
    return statistic(done) if done else None


def _sums(rows: Sequence[dict], values: Sequence[float]):
    """By problem: of the values, and how many they are."""
    return by_problem([r["problem"] for r in rows], values, [1] * len(rows))


def _completed(rows) -> list[dict]:
    return [r for r in rows if r["status"] == "completed"]


def play(problem: str, planner: str, seed: int, out: Path, vlm: str | None = None) -> str:
    """Run one trial, with a planner that asks this VLM if one is named; returns a line that says how it went."""
    from torc.specs.trial import TrialSpec
    from torc.trials.trial import run_trial
    from torc.vlm.config import VlmConfig, parse_vlm

    config = None if vlm is None else VlmConfig(*parse_vlm(vlm))
    trial = run_trial(TrialSpec.of(problem, planner, seed, vlm=config), out, say=lambda text: None)
    result = trial.result
    if result.status != "completed":
        return f"{out.name}: {result.status}: {result.error}"
    verdict = "retrieved" if result.retrieved else result.end
    return f"{out.name}: {verdict}, {result.picks} picks, {result.drops} drops"


def main() -> None:
    """Play, draw, write."""
    args = tyro.cli(Args)
    args.out.mkdir(parents=True, exist_ok=True)
    if not args.table_only:
        todo = [
            (problem, contender.planner, seed, path, contender.vlm)
            for problem, contender, seed, path in trials(args)
            if not (path / "result.json").exists()
        ]
        run_jobs(play, todo, args.workers)
    rows, wanted = load(args), len(list(trials(args)))
    note = "" if len(rows) == wanted else f"Incomplete: {len(rows)} of {wanted} trials."
    text = "\n\n".join(filter(None, [note, table(rows, args)]))
    print(text)
    (args.out / "table.md").write_text(text + "\n")
    draw(panels(rows, args), [args.out / f"break_even.{kind}" for kind in ("svg", "png")], note)


if __name__ == "__main__":
    main()
