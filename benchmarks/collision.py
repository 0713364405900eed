"""How long the collision world and its checks take, beside coal on the same spheres and voxels.

    python -m benchmarks.collision [--objects 15] [--configurations 1000]

coal (a development dependency) gets one octree per object, since it has to say who is touched, not only whether.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from tests.helpers.reaching import reaching_qpos
from torc.collision.collision_world import CollisionWorld, build_collision_world
from torc.collision.contacts import blockers, collides, robot_arrays
from torc.collision.distances import distance_field
from torc.motion.config import MotionConfig
from torc.motion.mover import Mover
from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers
from torc.robots.loading import load_robot
from torc.testing.views import view_of_clutter
from torc.workspace.workspace_files import load_workspace


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--objects", type=int, default=15)
    parser.add_argument("--configurations", type=int, default=1000)
    args = parser.parse_args()
    robot, workspace = load_robot(), load_workspace()
    view = view_of_clutter(0, args.objects, workspace)
    world = view.world
    print(
        f"{np.count_nonzero(world.kind)} of {world.kind.size} voxels occupied, {len(robot.spheres)} spheres"
    )

    report("distance field", _best(lambda: distance_field(world.kind > 0, 0.01)))
    report("collision world, all of it", _best(lambda: build_collision_world(view.volume, workspace)))

    arrays = robot_arrays(robot)
    q = reaching_qpos(robot, args.configurations, np.random.default_rng(1))
    n = len(q)
    ours = _best(lambda: blockers(world, arrays, q, 0.085, 0))
    report(f"blocker masks, {n} configurations", ours, n)
    theirs = _best(lambda: coal_masks(world, robot, q[:50]), 2) * n / 50
    report(f"the same by coal, {args.objects} octrees (50 measured)", theirs, n)
    print(f"  ratio {theirs / ours:.0f}")
    report("in collision at all", _best(lambda: collides(world, arrays, q, 0.085)), n)
    space = Mover(robot, MotionConfig()).space(world, 0.085)
    a, b = q[: n // 2], q[n // 2 : 2 * (n // 2)]
    report("edges between them", _best(lambda: space.edges_collide(a, b)), len(a))
    free = q[~collides(world, arrays, q, 0.085)]
    near = free + np.random.default_rng(0).normal(0, 0.1, free.shape)
    report(
        "short edges from free ones",
        _best(lambda: space.edges_collide(free, near)),
        len(free),
    )


def coal_masks(world: CollisionWorld, robot: RobotDescription, qpos: np.ndarray) -> np.ndarray:
    """Blocker masks with coal, sphere by sphere; table, bin and self collision left out."""
    import coal

    centers, trees = world.grid.centers(), []
    for k in range(64):
        mine = (world.kind > 0) & (world.bits & (np.uint64(1) << np.uint64(k)) != 0)
        if mine.any():
            trees.append((k, coal.makeOctree(np.ascontiguousarray(centers[mine]), world.grid.voxel_size_m)))
    arm = robot.spheres.link < robot.arm.dof
    padding = np.where(arm, world.config.padding_m, world.config.gripper_padding_m)
    shapes = [coal.Sphere(float(r)) for r in robot.spheres.radii + padding]
    places = sphere_centers(robot, qpos, np.full(len(qpos), 0.085))
    identity, request = coal.Transform3s.Identity(), coal.CollisionRequest()
    masks = np.zeros(len(qpos), dtype=np.uint64)
    for i, spheres in enumerate(places):
        for k, tree in trees:
            for shape, p in zip(shapes, spheres):
                result = coal.CollisionResult()
                if coal.collide(tree, identity, shape, coal.Transform3s(np.eye(3), p), request, result):
                    masks[i] |= np.uint64(1) << np.uint64(k)
                    break
    return masks


def report(what: str, seconds: float, n: int | None = None) -> None:
    """One line."""
    each = f"   {1e6 * seconds / n:8.2f} us each" if n else ""
    print(f"{what:55s} {1e3 * seconds:9.2f} ms{each}")


def _best(call: Callable[[], object], repeats: int = 7) -> float:
    """Least time of several calls, after one that compiles."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


if __name__ == "__main__":
    main()
