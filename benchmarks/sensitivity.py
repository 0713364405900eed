"""What the numbers of a set hang on: the same trials in other worlds.

    python -m benchmarks.sensitivity --problems torc40 --seeds 3 --workers 2

The simulation has to take masses, friction and a robot's sense of touch from somewhere. This plays the set as it
is, and with one thing changed at a time (see CONDITIONS), and prints a table. Trials already in --out are not played
again. A trial in which the physics breaks, or whose target falls before the first pick, is errored, not failed.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.processes import run_jobs
from torc.benchmark import intervals
from torc.benchmark.intervals import by_problem
from torc.errors import TorcError
from torc.objects.library import load_object
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh
from torc.problems.problem import Problem
from torc.robots.execution import ExecutionConfig


@dataclass(frozen=True)
class Condition:
    """A world to play in.

    Attributes:
        what: in words, for the table.
        density_kg_m3: of all objects; None for their own (median 824).
        friction: factor on the sliding friction of objects and pads.
        torsion: the pads resist turning about their normal.
        pad_softness_s: time constant of the pads' contacts (MuJoCo's solref); None for the robot's own (.007).
        guard: contact stops the arm.
        scale: factor on the objects and the distances between them; the robot and the table stay as they are.
        noise: that of a stereo camera.
    """

    what: str
    density_kg_m3: float | None = None
    friction: float = 1.0
    torsion: bool = True
    pad_softness_s: float | None = None
    guard: bool = True
    scale: float = 1.0
    noise: bool = False


CONDITIONS = {
    "as-it-is": Condition("as it is"),
    "light": Condition("50 kg/m3, as the paper's authors", density_kg_m3=50.0),
    "slippery": Condition("friction halved, pads without torsion", friction=0.5, torsion=False),
    "stiff-pads": Condition("pads as stiff as can be", pad_softness_s=0.004),
    "no-guard": Condition("no guard against contact", guard=False),
    "large": Condition("objects 20 % larger", scale=1.2),
    "noise": Condition("sensor noise", noise=True),
}


@dataclass(frozen=True)
class Args:
    """Play, then print the table."""

    problems: str = "torc40"
    """A set, problems or a directory of them, with commas between."""
    out: Path = Path("runs/sensitivity")
    """Directory of the trials."""
    planners: tuple[str, ...] = ("random", "dg-select")
    """Who chooses what to pick."""
    conditions: tuple[str, ...] = field(default_factory=lambda: tuple(CONDITIONS))
    """Which worlds, by name."""
    seeds: int = 3
    """Seeds 0..N-1."""
    workers: int = 2
    """Processes."""


def scaled_problem(problem: Problem, scale: float, support_z_m: float) -> Problem:
    """The scene grown about its middle on the table: what touched still touches, nothing gets into anything else."""
    middle = np.mean([o.position for o in problem.objects], axis=0)
    middle[2] = support_z_m

    def moved(position: Sequence[float]) -> tuple[float, float, float]:
        x, y, z = middle + scale * (np.array(position) - middle)
        return float(x), float(y), float(z)

    return replace(problem, objects=tuple(replace(o, position=moved(o.position)) for o in problem.objects))


def changed_model(model: ObjectModel, condition: Condition) -> ObjectModel:
    """An object as it is in that world. Scaled, it keeps its density."""
    s = condition.scale
    pieces = tuple(_scaled_piece(p, s) for p in model.pieces)
    mass_kg = model.mass_kg * s**3
    if condition.density_kg_m3 is not None:
        mass_kg = condition.density_kg_m3 * sum(p.volume_m3 for p in pieces)
    return replace(
        model,
        mass_kg=mass_kg,
        pieces=pieces,
        visuals=tuple(_scaled_visual(v, s) for v in model.visuals),
        size_m=tuple(s * edge for edge in model.size_m),
        friction=condition.friction * model.friction,
    )


def _scaled_piece(piece: CollisionPiece, s: float) -> CollisionPiece:
    vertices = None if piece.vertices is None else s * piece.vertices
    x, y, z = piece.position
    return replace(
        piece, size=tuple(s * e for e in piece.size), position=(s * x, s * y, s * z), vertices=vertices
    )


def _scaled_visual(visual: VisualMesh, s: float) -> VisualMesh:
    return replace(visual, vertices=s * visual.vertices)


def play(problem_name: str, planner: str, seed: int, name: str, path: Path) -> str:
    """Play a trial and keep what came of it, complete or not at all."""
    try:
        facts = _played(problem_name, planner, seed, CONDITIONS[name])
    except TorcError as error:
        facts = {"errored": str(error)}
    aside = path.with_suffix(".partial")
    aside.write_text(
        json.dumps({"problem": Path(problem_name).stem, "planner": planner, "condition": name, **facts})
    )
    aside.rename(path)
    return f"{path.stem}: {facts.get('errored') or facts['end']}"


def _played(problem_name: str, planner: str, seed: int, condition: Condition) -> dict[str, Any]:
    from torc.episode.events import Started
    from torc.episode.loop import run_episode
    from torc.episode.simulated import episode_in
    from torc.episode.steps import EpisodeConfig
    from torc.pipeline.building import build_system
    from torc.pipeline.planners import make_planner
    from torc.problems.problem import load_problem
    from torc.sim.robot import SimulatedRobot, SimulatedRobotConfig
    from torc.sim.simulated_world import build_world
    from torc.specs.conditions import Conditions

    system = build_system(Conditions(noise=condition.noise))
    robot, workspace, config = system.robot, system.workspace, EpisodeConfig(seed=seed)
    problem = scaled_problem(load_problem(problem_name), condition.scale, workspace.support_z_m)
    world = build_world(problem, robot, workspace, load_model=cache(_loader(condition)))
    for side in robot.pad_geom_names:
        for pad in side:
            friction = world.model.geom(pad).friction
            friction[0] *= condition.friction
            friction[1] *= condition.torsion
            if condition.pad_softness_s is not None:
                world.model.geom(pad).solref[0] = condition.pad_softness_s
    guards = ExecutionConfig() if condition.guard else ExecutionConfig(free_guard=None, approach_guard=None)
    with SimulatedRobot(world, SimulatedRobotConfig(execution=guards)) as simulated:
        simulated.take_over()
        started = Started(problem.name, planner, seed, problem.description, config.max_picks)
        result = run_episode(episode_in(simulated, system, config), make_planner(planner), started)
    tried = [o for o in result.outcomes if o.result.grasp_tried]
    return {
        "end": result.end.value,
        "cost": result.picks if result.retrieved else config.max_picks,
        "retrieved": result.retrieved,
        "drops": len(result.dropped),
        "tried": len(tried),
        "held": sum(o.held_after_lift for o in tried),
        "delivered": sum(o.delivered for o in tried),
    }


def _loader(condition: Condition) -> Callable[[str], ObjectModel]:
    return lambda name: changed_model(load_object(name), condition)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """A line per world and planner, with 95 % intervals over problems."""
    header = (
        *("world", "planner", "trials", "retrieved", "with no drop", "picks to retrieval", "target lost"),
        *("grasps held", "delivered", "errored"),
    )
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    for name, condition in CONDITIONS.items():
        for planner in dict.fromkeys(r["planner"] for r in rows):
            mine = [r for r in rows if (r["condition"], r["planner"]) == (name, planner)]
            if mine:
                lines.append("| " + " | ".join((condition.what, planner, *_cells(mine))) + " |")
    return "\n".join(lines)


def _cells(mine: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    done = [r for r in mine if "errored" not in r]
    errored = f"{len(mine) - len(done)}"
    if not done:
        return "0", *7 * ("",), errored

    def share(hits: Callable[[dict], float], totals: Callable[[dict], float] = lambda r: 1) -> str:
        columns = by_problem([r["problem"] for r in done], [hits(r) for r in done], [totals(r) for r in done])
        return intervals.share(*columns).text(2)

    sums = by_problem([r["problem"] for r in done], [r["cost"] for r in done], [1] * len(done))
    return (
        str(len(done)),
        share(lambda r: r["retrieved"]),
        share(lambda r: r["retrieved"] and not r["drops"]),
        intervals.mean(*sums, 15).text(1),
        f"{sum(r['end'] == 'target lost' for r in done)}",
        share(lambda r: r["held"], lambda r: r["tried"]),
        share(lambda r: r["delivered"], lambda r: r["tried"]),
        errored,
    )


def main() -> None:
    """Play and print."""
    from torc.problems.sets import select_problems

    args = tyro.cli(Args, description=__doc__)
    args.out.mkdir(parents=True, exist_ok=True)
    files = {
        (problem, planner, seed, name): args.out / f"{Path(problem).stem}-{planner}-{name}-{seed}.json"
        for seed in range(args.seeds)
        for problem in select_problems(args.problems)
        for name in args.conditions
        for planner in args.planners
    }
    run_jobs(play, [(*key, path) for key, path in files.items() if not path.exists()], args.workers)
    print("\n" + table([json.loads(path.read_text()) for path in files.values() if path.exists()]))


if __name__ == "__main__":
    main()
