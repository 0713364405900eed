"""What readings that are missing from the depth cost: grasps and choices, with and without bridged holes.

    torc problems generate --count 8 --seed 880000 --out runs/missing_depth_problems
    python -m benchmarks.missing_depth --problems validation,runs/missing_depth_problems

DG-SELECT plays the problems; each of its first looks is a frame. Readings are then taken away from each frame in
several ways, and the pipeline of a trial looks at what is left as if it were its first look. The table compares that
with the complete frame:

- valid grasps: how many the look finds, as a share of those in the complete frame;
- left, gained: the candidates of the complete frame, checked again against the space that the damaged one leaves
  unseen. The share of the valid ones that stay valid, and how many others become so, as a share of the valid ones;
- same choice: frames in which DG-SELECT picks the same object; none: those without a graspable one.

The first row has no damage and other random numbers for the candidates: how much of the rest is chance. Columns are
given for bridged holes, the default, and for holes left as they are. Frames already in --out are not made again.
"""

import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import tyro
from jaxtyping import Bool, Float32

from benchmarks.processes import run_jobs
from torc.episode.events import Event, Looked, Started
from torc.episode.loop import run_episode
from torc.episode.simulated import episode_in, simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.io.record_files import load_record, save_record
from torc.pipeline.better_bet import hold_back_unlikely
from torc.pipeline.building import build_system
from torc.pipeline.look import Look, Pipeline
from torc.pipeline.planners import make_planner
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import Capture, GraspStatus
from torc.specs.conditions import Conditions

Damage = Callable[[Float32[np.ndarray, "h w"], np.random.Generator], Bool[np.ndarray, "h w"]]
"""Which pixels of a depth image lose their reading."""


@dataclass(frozen=True)
class Args:
    """Make frames, damage them, compare."""

    problems: str = "validation"
    """A set, problems or a directory of them, with commas between; not what planners are compared on."""
    out: Path = Path("runs/missing_depth")
    """Directory of the frames."""
    looks: int = 3
    """Looks of each trial that become frames."""
    frames: int = 50
    """Frames at most."""
    workers: int = 2
    """Processes."""


def gather(problem_name: str, looks: int, directory: Path) -> str:
    """Play a trial and keep what its first looks saw, a file each; complete or not at all."""
    problem, system = load_problem(problem_name), build_system(Conditions())
    seen: list[Capture] = []

    def note(event: Event) -> None:
        if isinstance(event, Looked):
            seen.append(event.look.captures[0])

    with simulated_robot(system, problem) as simulated:
        simulated.take_over()
        planner = make_planner("dg-select")
        started = Started(problem.name, planner.name, 0, problem.description, looks)
        run_episode(episode_in(simulated, system, EpisodeConfig(looks), [note]), planner, started)
    aside = directory.with_suffix(".partial")
    aside.mkdir(parents=True, exist_ok=True)
    for pick, capture in enumerate(seen[:looks]):
        save_record(capture, aside / f"{pick}.npz")
    aside.rename(directory)
    return f"{directory.name}: {len(seen[:looks])} frames"


def speckles(share: float) -> Damage:
    """Single pixels, anywhere."""
    return lambda depth_m, rng: rng.random(depth_m.shape) < share


def blobs(share: float) -> Damage:
    """Discs of 3 to 7 pixels, anywhere, until as many pixels are lost."""

    def lost(depth_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        mask = np.zeros(depth_m.shape, dtype=np.uint8)
        while np.count_nonzero(mask) < share * mask.size:
            row, col = rng.integers(mask.shape[0]), rng.integers(mask.shape[1])
            cv2.circle(mask, (int(col), int(row)), int(rng.integers(1, 4)), 1, thickness=-1)
        return mask.astype(bool)

    return lost


def edges(px: int) -> Damage:
    """All pixels within px of a jump by more than 5 % of the distance, on both of its sides."""

    def lost(depth_m: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        jump = np.zeros(depth_m.shape, dtype=np.uint8)
        for axis in (0, 1):
            a, b = (np.moveaxis(x, axis, 0) for x in (depth_m, jump))
            found = np.abs(np.diff(a, axis=0)) > 0.05 * np.minimum(a[1:], a[:-1])
            b[1:] |= found
            b[:-1] |= found
        return cv2.dilate(jump, np.ones((2 * px - 1, 2 * px - 1), np.uint8)).astype(bool)

    return lost


def both(first: Damage, second: Damage) -> Damage:
    """What either takes."""
    return lambda depth_m, rng: first(depth_m, rng) | second(depth_m, rng)


CHANCE = "nothing, other random numbers"
DAMAGES: dict[str, Damage] = {
    "speckles .1 %": speckles(0.001),
    "speckles 1 %": speckles(0.01),
    "speckles 5 %": speckles(0.05),
    "speckles 15 %": speckles(0.15),
    "blobs of 3-7 px, 1 %": blobs(0.01),
    "blobs of 3-7 px, 5 %": blobs(0.05),
    "edges, 1 px": edges(1),
    "edges, 2 px": edges(2),
    "edges, 3 px": edges(3),
    "edges, 2 px, and speckles 1 %": both(edges(2), speckles(0.01)),
}


BRIDGED, LEFT_OPEN = "holes bridged", "holes left open"


@dataclass(frozen=True)
class Row:
    """One frame under one damage, beside the complete frame: counts of grasps, and ids (None for no choice)."""

    damage: str
    holes: str
    full: int
    found: int
    sound: int
    left: int
    gained: int
    full_choice: int | None
    choice: int | None


def compare(frame: Path, path: Path) -> str:
    """Look at a frame, complete and damaged in every way, and keep the rows."""
    pipeline = build_system(Conditions()).pipeline
    capture = load_record(frame, Capture)
    open_holes = replace(pipeline, occlusion=replace(pipeline.occlusion, hole_rad=0.0))
    full, frame_name = look(pipeline, capture), f"{frame.parent.name}/{frame.stem}"
    before = _sound(full, full, pipeline)
    rows = [row(full, before, look(pipeline, capture, seed=1), pipeline, CHANCE, BRIDGED)]
    for number, (name, damage) in enumerate(DAMAGES.items()):
        rng = np.random.default_rng([zlib.crc32(frame_name.encode()), number])
        exact = capture.observation
        lost = damage(exact.depth_m, rng)
        measured = replace(exact, depth_m=np.where(lost, np.float32(0), exact.depth_m))
        damaged = replace(capture, observation=measured)
        rows += [
            row(full, before, look(some, damaged), some, name, holes)
            for holes, some in ((BRIDGED, pipeline), (LEFT_OPEN, open_holes))
        ]
    path.write_text(json.dumps([asdict(r) for r in rows]))
    return frame_name


def look(pipeline: Pipeline, capture: Capture, seed: int = 0) -> Look:
    """As the first look of a trial."""
    return pipeline.look(capture, seed=seed)


def row(
    full: Look, before: Bool[np.ndarray, "n"], damaged: Look, pipeline: Pipeline, damage: str, holes: str
) -> Row:
    """The damaged look beside the complete one, whose sound candidates are `before`."""
    after = _sound(full, damaged, pipeline)
    return Row(
        damage,
        holes,
        full=int(full.context.report.valid_total.sum()),
        found=int(damaged.context.report.valid_total.sum()),
        sound=int(np.count_nonzero(before)),
        left=int(np.count_nonzero(before & after)),
        gained=int(np.count_nonzero(after & ~before)),
        full_choice=choice(full),
        choice=choice(damaged),
    )


def _sound(full: Look, seen: Look, pipeline: Pipeline) -> Bool[np.ndarray, "n"]:
    """Which candidates of the complete frame can be carried out, by what another look saw."""
    candidates, scene = full.context.grasps, full.context.scene
    every = replace(pipeline, motion=replace(pipeline.motion, max_grasps=len(candidates)))
    report = every.evaluate(candidates, scene, seen.context.volume, seen.world)
    return hold_back_unlikely(report, candidates, pipeline.min_score).status == GraspStatus.VALID


def choice(look: Look) -> int | None:
    """What DG-SELECT picks."""
    return make_planner("dg-select").decide(look.context, np.random.default_rng(0)).object_id


def table(rows: Sequence[Row]) -> str:
    """Shares over all frames together."""
    columns = ("valid grasps", "left", "gained", "same choice", "no choice")
    lines = [
        "| missing | " + " | ".join(columns) + " | " + " | ".join(f"{c}, open" for c in columns) + " |",
        "|---" * (1 + 2 * len(columns)) + "|",
    ]
    for damage in (CHANCE, *DAMAGES):
        cells = [cell for holes in (BRIDGED, LEFT_OPEN) for cell in _cells(rows, damage, holes)]
        lines.append(f"| {damage} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cells(rows: Sequence[Row], damage: str, holes: str) -> list[str]:
    some = [r for r in rows if (r.damage, r.holes) == (damage, holes)]
    if not some:
        return [""] * 5
    full = sum(r.full for r in some)
    sound = sum(r.sound for r in some)
    shares = [
        sum(r.found for r in some) / full,
        *(sum(getattr(r, n) for r in some) / sound for n in ("left", "gained")),
    ]
    same = sum(r.choice == r.full_choice for r in some) / len(some)
    return [*(f"{s:.2f}" for s in shares), f"{same:.2f}", str(sum(r.choice is None for r in some))]


def main() -> None:
    """Gather, compare and print."""
    args = tyro.cli(Args, description=__doc__)
    frames, rows = args.out / "frames", args.out / "rows"
    rows.mkdir(parents=True, exist_ok=True)
    trials = {problem: frames / Path(problem).stem for problem in select_problems(args.problems)}
    run_jobs(gather, [(p, args.looks, d) for p, d in trials.items() if not d.exists()], args.workers)
    found = [file for d in trials.values() for file in sorted(d.glob("*.npz"))][: args.frames]
    jobs = [(file, rows / f"{file.parent.name}-{file.stem}.json") for file in found]
    run_jobs(compare, jobs, args.workers)
    compared = [Row(**r) for _, path in jobs for r in json.loads(path.read_text())]
    full = sum(r.full for r in compared if r.damage == CHANCE)
    print(f"\n{len(jobs)} frames with {full} valid grasps in all\n\n{table(compared)}")


if __name__ == "__main__":
    main()
