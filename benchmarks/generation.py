"""Freshly generated problems: how many are made and hold up, why scenes are rejected, how long it takes.

    python -m benchmarks.generation --count 200 --workers 2

Half structured, half unstructured. Every problem is saved, loaded again and checked as `torc problems validate` does:
10 simulated seconds of rest, the visible fraction, the first look, the pruning rule. Seconds are those of making a
problem in its process; imports, compilation and the check do not count.
"""

import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import tyro

from torc.generation.config import GenerationConfig, WantedHiddenness
from torc.generation.generator import GeneratedProblem, generate_problem, inspector_for
from torc.generation.validation import validate_problem
from torc.problems.problem import load_problem, save_problem
from torc.processes import open_pool
from torc.robots.names import DEFAULT_ROBOT

BUDGET_S = 5.0
"""What making one problem may take."""


@dataclass(frozen=True)
class Args:
    """Make problems and check them."""

    count: int = 200
    """Problems, half of each category."""
    seed: int = 10_000
    """Seed of the first."""
    hidden: WantedHiddenness = "any"
    """How much of the target may be in sight."""
    objects: tuple[int, int] = (8, 20)
    """Smallest and largest number of objects."""
    workers: int = 1
    """Processes."""
    keep: Path | None = None
    """Directory where the problems are left; nowhere by default."""


@dataclass(frozen=True)
class Row:
    """One problem: facts of its making and of its check."""

    seed: int
    category: str
    made: bool
    scenes: int
    rejections: dict[str, int]
    cpu_s: float
    wall_s: float
    hiddenness: str = ""
    objects: int = 0
    failed: tuple[str, ...] = ()


def measure(config: GenerationConfig, seed: int, keep: Path | None = None) -> Row:
    """Make one problem and check it; it is left in `keep`."""
    inspector = inspector_for(DEFAULT_ROBOT)
    cpu, wall = time.process_time(), time.perf_counter()
    made = generate_problem(config, seed, inspector)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    rejections = {reason.name.lower(): n for reason, n in made.rejections.items()}
    if not isinstance(made, GeneratedProblem):
        return Row(seed, config.category, False, made.attempts, rejections, cpu, wall)
    with TemporaryDirectory() as directory:
        path = (keep or Path(directory)) / f"{made.problem.name}.yaml"
        save_problem(made.problem, path)
        report = validate_problem(load_problem(path), inspector)
    failed = tuple(f"{check.name}: {check.text}" for check in report.checks if not check.passed)
    hiddenness, objects = made.difficulty.hiddenness.value, made.difficulty.objects
    return Row(seed, config.category, True, made.attempts, rejections, cpu, wall, hiddenness, objects, failed)


def table(rows: list[Row]) -> str:
    """A line per category."""
    lines = [
        "| scenes | wanted | made | valid | scenes tried | objects, median | hidden / partly / visible "
        f"| wall s: median, mean, p95 | under {BUDGET_S:g} s | CPU s: median, mean |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for category in ("structured", "unstructured", "all"):
        mine = [r for r in rows if category in ("all", r.category)]
        made = [r for r in mine if r.made]
        if not made:
            continue
        groups = Counter(r.hiddenness for r in made)
        cpu, wall = np.array([r.cpu_s for r in mine]), np.array([r.wall_s for r in mine])
        valid = sum(not r.failed for r in made)
        lines.append(
            f"| {category} | {len(mine)} | {len(made)} | {valid} ({100 * valid / len(mine):.1f} %) "
            f"| {sum(r.scenes for r in mine)} | {np.median([r.objects for r in made]):.0f} "
            f"| {groups['hidden']} / {groups['partly']} / {groups['visible']} "
            f"| {np.median(wall):.1f}, {wall.mean():.1f}, {np.percentile(wall, 95):.1f} "
            f"| {100 * np.mean(wall < BUDGET_S):.1f} % | {np.median(cpu):.1f}, {cpu.mean():.1f} |"
        )
    return "\n".join(lines)


def reasons(rows: list[Row]) -> str:
    """Rejected scenes by reason, and what failed later."""
    lines = ["| why a scene was rejected | structured | unstructured |", "|---|---|---|"]
    counts = {c: Counter[str]() for c in ("structured", "unstructured")}
    for row in rows:
        counts[row.category].update(row.rejections)
    for reason, _ in sum(counts.values(), Counter[str]()).most_common():
        lines.append(f"| {reason} | {counts['structured'][reason]} | {counts['unstructured'][reason]} |")
    lines += [f"\nNot made: {r.category} seed {r.seed}" for r in rows if not r.made]
    lines += [f"\nNot valid: {r.category} seed {r.seed}: {'; '.join(r.failed)}" for r in rows if r.failed]
    return "\n".join(lines)


def main() -> None:
    """Run and print."""
    args = tyro.cli(Args)
    structured = GenerationConfig("structured", args.objects, args.hidden)
    unstructured = GenerationConfig("unstructured", args.objects, args.hidden)
    configs = [(structured, unstructured)[i % 2] for i in range(args.count)]
    seeds = [args.seed + i for i in range(args.count)]
    if args.keep is not None:
        args.keep.mkdir(parents=True, exist_ok=True)
    measure(structured, 0)  # compiles what is not cached
    rows: list[Row] = []
    with open_pool(args.workers) as pool:
        for row in pool.map(measure, configs, seeds, [args.keep] * args.count):
            rows.append(row)
            print(f"{len(rows):>4} {row}", flush=True)
    print(f"\n{table(rows)}\n\n{reasons(rows)}")


if __name__ == "__main__":
    main()
