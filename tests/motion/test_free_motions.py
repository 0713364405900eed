"""What is taken for an obstacle on the way to the bin: what the held object hid, where there is a way around it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from jaxtyping import Bool, Float

from torc.collision.collision_world import FREE, UNKNOWN, CollisionWorld, world_from_voxels
from torc.collision.contacts import carved, collides
from torc.motion.config import MotionConfig, SearchConfig
from torc.motion.protocol import PickRequest
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.records import PickPlan

BIT = np.uint64(1) << np.uint64(1)
"""Of the object that is held."""


@dataclass(frozen=True)
class Transfer:
    """From the end of a planned lift to the bin, in worlds that differ from the one it was planned in."""

    planner: SamplingMotionPlanner
    request: PickRequest
    plan: PickPlan

    def through(self, world: CollisionWorld) -> Float[np.ndarray, "n dof"]:
        start, context = self.plan.lift.qpos[-1], self._context(world)
        return self.planner.free.to_bin(context, start, np.random.default_rng(0)).qpos

    def carved(self, world: CollisionWorld, q: Float[np.ndarray, "dof"], margin_m: float) -> CollisionWorld:
        return carved(world, self.planner.robot, q, self.plan.width_m, margin_m, self._held)

    def touches(self, qpos: Float[np.ndarray, "n dof"], voxels: Bool[np.ndarray, "nx ny nz"]) -> bool:
        """Whether robot or object touch hidden voxels, grazing and what is carved at the start left out."""
        world, config = hiding(self.request.world, voxels), self.request.world.config
        opened = self.carved(
            replace(world, kind=np.where(voxels, world.kind, np.uint8(FREE)), boxes=world.boxes[:0]),
            qpos[0],
            self.planner.config.carve_margin_m,
        )
        less = self.planner.config.search.grazing_m
        looser = replace(
            config,
            padding_m=config.padding_m - less,
            gripper_padding_m=config.gripper_padding_m - less,
            attached_padding_m=config.attached_padding_m - less,
        )
        opened = replace(opened, config=looser)
        return bool(collides(opened, self.planner.robot, qpos, self.plan.width_m, attached=self._held).any())

    @property
    def _held(self) -> Float[np.ndarray, "a 4"]:
        return self._context(self.request.world).held.possible

    def _context(self, world: CollisionWorld):
        request = replace(self.request, world=world)
        return self.planner.context(request, self.plan.grasp_index, self.planner.held(request))


@pytest.fixture
def transfer_of(request_alone):
    def make(planner: SamplingMotionPlanner, y: float = 0.0) -> Transfer:
        request = request_alone(y)
        plan = planner.plan_pick(request, np.random.default_rng(0))
        assert isinstance(plan, PickPlan), plan
        return Transfer(planner, request, plan)

    return make


@pytest.mark.parametrize("y", [0.0, -0.1])
def test_what_a_held_object_hid_stays_an_obstacle_where_there_is_a_way_around_it(planner, transfer_of, y):
    transfer = transfer_of(planner, y)
    wall = in_the_way(transfer)
    assert not transfer.touches(transfer.through(hiding(transfer.request.world, wall)), wall)


def test_what_a_held_object_hid_is_free_where_it_leaves_no_way(robot, workspace, transfer_of):
    """Every way is a straight edge to the nearest goal."""
    config = MotionConfig(search=SearchConfig(max_iterations=0, goals=1))
    transfer = transfer_of(SamplingMotionPlanner(robot, workspace, config))
    wall = in_the_way(transfer)
    assert transfer.touches(transfer.through(hiding(transfer.request.world, wall)), wall)


def test_what_a_held_object_hid_is_free_where_the_arm_is_in_that_already(planner, transfer_of):
    transfer = transfer_of(planner)
    everything = hiding(transfer.request.world, np.ones_like(transfer.request.world.kind, dtype=bool))
    nothing = everything.without_object(transfer.plan.object_id)
    np.testing.assert_array_equal(transfer.through(everything), transfer.through(nothing))


def in_the_way(transfer: Transfer) -> Bool[np.ndarray, "nx ny nz"]:
    """Voxels that robot and object touch on their way to the bin, and that are far from where it begins."""
    world, qpos = transfer.request.world, transfer.through(transfer.request.world)
    full = replace(world, kind=np.full_like(world.kind, UNKNOWN))
    there = transfer.carved(full, qpos[len(qpos) // 3], 0.0)
    near = transfer.carved(full, qpos[0], 0.08)
    voxels = (there.kind == FREE) & (near.kind != FREE)
    assert transfer.touches(qpos, voxels)
    return voxels


def hiding(world: CollisionWorld, voxels: Bool[np.ndarray, "nx ny nz"]) -> CollisionWorld:
    """The world as if the object also hid the free ones of these voxels."""
    more = voxels & (world.kind == FREE)
    kind, bits = np.where(more, np.uint8(UNKNOWN), world.kind), np.where(more, BIT, world.bits)
    return world_from_voxels(world.grid, kind, bits, world.boxes, world.box_names, world.config)
