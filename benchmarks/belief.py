"""The planner `belief`: how long it decides, beside DG-SELECT, and how well its belief tells where the target is.

    python -m benchmarks.belief [--problems torc40,validation] [--repeats 3]

Times are processor time of this process, so that other work on the machine counts little. At the first look of every
problem whose target is out of sight then, the belief is compared with where the target is: the share of it on the
objects that hide the target, within 5 cm of it, and how often the target lies in the region that holds 50 or 90 % of
the belief, which should be in 50 or 90 % of the problems.
"""

import time
from dataclasses import dataclass

import numpy as np
import tyro
from jaxtyping import Float
from scipy.ndimage import gaussian_filter

from torc.episode.simulated import simulated_robot, wanted_in
from torc.occlusion.volume import hidden_volumes_m3
from torc.pipeline.building import System, build_system
from torc.problems.problem import Problem, load_problem
from torc.problems.sets import select_problems
from torc.records import TARGET_ID, PlanningContext
from torc.sim.simulated_world import Presence
from torc.specs.conditions import Conditions
from torc.task_planning.belief.belief_planner import BeliefPlanner
from torc.task_planning.belief.hiding import Belief, believe
from torc.task_planning.belief.particles import bodies_of, propose
from torc.task_planning.belief.settings import BeliefConfig
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.protocol import TaskPlanner
from torc.testing.contexts import cluttered_context
from torc.workspace.workspace_files import load_workspace

NEAR_M = 0.05
CELL_M = 0.02
HIDES_SHARE = 0.1
"""An object hides the target if it covers this share of what would be seen of it."""


@dataclass(frozen=True)
class Args:
    """Decision times, and the belief at the first look."""

    problems: str = "torc40,validation"
    """Sets, problems, problem files, comma-separated; those whose target is in sight at first are passed over."""
    repeats: int = 3
    """How often each decision is timed."""
    scenes: int = 10
    """Made-up scenes that a decision is timed for, of each size."""


@dataclass(frozen=True)
class FirstLook:
    """A look, and what it cannot show: the target's position (world), and how many of the pixels in which it would be
    seen each object covers.
    """

    context: PlanningContext
    position: Float[np.ndarray, "3"]
    covered: dict[int, int]


def first_look(system: System, problem: Problem) -> FirstLook:
    """The look before the first pick."""
    with simulated_robot(system, problem) as simulated:
        simulated.take_over()
        capture, world = simulated.capture(), simulated.world
        look = system.pipeline.look(capture, wanted=wanted_in(system, problem), picks_left=15)
        position = world.positions[TARGET_ID].copy()
        for other in np.flatnonzero(world.present).tolist():
            if other != TARGET_ID:
                world.park(other, Presence.DELIVERED)
        world.update_position_stage()
        alone = simulated.capture().label_image == TARGET_ID
    covering, counts = np.unique(capture.label_image[alone], return_counts=True)
    return FirstLook(look.context, position, dict(zip(covering.tolist(), counts.tolist())))


def belief_at(context: PlanningContext, config: BeliefConfig) -> Belief:
    """What the planner believes then."""
    rng = np.random.default_rng(0)
    bodies = bodies_of(context.scene, context.volume)
    particles = propose(context.volume, bodies, config.particles, rng, context.target_size_m)
    eye = np.asarray(context.scene.observation.T_world_camera, dtype=float)[:3, 3]
    return believe(particles, context.volume, bodies, eye, config.hiding, rng)


def mass_above(belief: Belief, position: Float[np.ndarray, "3"]) -> float:
    """Share of the belief in places, seen from above, that are likelier than the target's: below .5 in half of the
    problems if the belief is calibrated. 1 where it rules the target's place out.
    """
    xy = belief.poses[:, :2]
    low = np.minimum(xy.min(axis=0), position[:2]) - 5 * CELL_M
    shape = np.ceil((np.maximum(xy.max(axis=0), position[:2]) - low) / CELL_M).astype(int) + 5
    density = np.zeros(shape)
    np.add.at(density, tuple(((xy - low) / CELL_M).astype(int).T), belief.weights)
    density = gaussian_filter(density, 1.0)
    density /= density.sum()
    own = density[tuple(((position[:2] - low) / CELL_M).astype(int))]
    return float(density[density > own].sum() + 0.5 * density[density == own].sum()) if own > 0 else 1.0


def row_of(look: FirstLook, config: BeliefConfig) -> dict[str, float]:
    """What a first look tells of the belief."""
    belief, ids = belief_at(look.context, config), look.context.scene.ids
    covered = {k: n for k, n in look.covered.items() if k in ids and k != TARGET_ID}
    hiders = [k for k, n in covered.items() if n >= HIDES_SHARE * sum(covered.values())]
    main = max(covered, key=lambda k: covered[k])
    own, volumes = belief.mass_hidden(), hidden_volumes_m3(look.context.volume, ids)
    by_volume = dict(zip(ids, (volumes / volumes.sum()).tolist()))
    near = np.linalg.norm(belief.poses[:, :2] - look.position[:2], axis=1) < NEAR_M
    above = mass_above(belief, look.position)
    return {
        "on the hiders, by hidden volume": sum(by_volume[k] for k in hiders),
        "on the hiders, belief": float(own[hiders].sum() / own.sum()),
        "main hider first, by hidden volume": float(max(by_volume, key=lambda k: by_volume[k]) == main),
        "main hider first, belief": float(int(np.argmax(own)) == main),
        "within 5 cm of the target, belief": float(belief.weights[near].sum()),
        "target in the 50 % region": float(above <= 0.5),
        "target in the 90 % region": float(above <= 0.9),
    }


def processor_ms(planner: TaskPlanner, context: PlanningContext, repeats: int) -> list[float]:
    """Processor time of each of several decisions, after one to warm up."""
    planner.decide(context, np.random.default_rng(0))
    times = []
    for _ in range(repeats):
        start = time.process_time()
        planner.decide(context, np.random.default_rng(0))
        times.append(1e3 * (time.process_time() - start))
    return times


def print_times(contexts: dict[str, list[PlanningContext]], repeats: int) -> None:
    """A row per kind of scene."""
    print("| scenes | objects in sight, median | belief, ms: median | p95 | dg-select, ms: median | p95 |")
    print("|---|---|---|---|---|---|")
    for name, group in contexts.items():
        cells = []
        for planner in (BeliefPlanner(), DgSelectPlanner()):
            times = [t for c in group for t in processor_ms(planner, c, repeats)]
            cells += [f"{v:.0f}" for v in np.percentile(times, [50, 95])]
        objects = np.median([len(c.scene.ids) for c in group])
        print(f"| {name} ({len(group)}) | {objects:.0f} | {' | '.join(cells)} |")


def interval(values: Float[np.ndarray, "n"]) -> tuple[float, float]:
    """95 % interval of a mean over problems, by resampling them."""
    rng = np.random.default_rng(0)
    means = values[rng.integers(len(values), size=(4000, len(values)))].mean(axis=1)
    return float(np.percentile(means, 2.5)), float(np.percentile(means, 97.5))


def main() -> None:
    """Run and print both tables."""
    args = tyro.cli(Args)
    system, config = build_system(Conditions()), BeliefConfig()
    looks = [first_look(system, load_problem(name)) for name in select_problems(args.problems)]
    hidden = [look for look in looks if look.context.scene.target_id is None and look.covered]
    camera = load_workspace().camera
    made_up = {
        f"made up, {n} objects": [
            cluttered_context(n, seed, camera, hidden_target=True) for seed in range(args.scenes)
        ]
        for n in (20, 60)
    }
    print_times({"first looks": [look.context for look in hidden], **made_up}, args.repeats)
    rows = [row_of(look, config) for look in hidden]
    print(f"\n| first look, {len(rows)} problems | mean [95 % interval] |\n|---|---|")
    for name in rows[0]:
        values = np.array([row[name] for row in rows])
        low, high = interval(values)
        print(f"| {name} | {values.mean():.2f} [{low:.2f}, {high:.2f}] |")


if __name__ == "__main__":
    main()
