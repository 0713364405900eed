"""Find who touches whom, how hard, and who lies on whom."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from torc.records import ROBOT
from torc.robots.description import RobotDescription
from torc.sim.simulated_world import World, restore_state, save_state

_BORNE_SHARE = 0.1
"""An object lies on another that bears this share of its weight from below; less is leaning against its side."""


class ContactReader:
    """Reads the contacts of the latest step. Vectorised: it runs hundreds of times per simulated second."""

    def __init__(self, world: World, robot: RobotDescription) -> None:
        self._world = world
        model = world.model
        self._is_robot: Bool[np.ndarray, g] = world.geom_labels == ROBOT
        fingers = [model.body(name).id for name in robot.finger_body_names]
        self._is_finger: Bool[np.ndarray, g] = np.isin(model.geom_bodyid, fingers)
        gripper = [model.body(robot.gripper_body_name).id]
        for body in range(gripper[0] + 1, model.nbody):  # parents come before children
            if model.body_parentid[body] in gripper:
                gripper.append(body)
        self._is_gripper: Bool[np.ndarray, g] = np.isin(model.geom_bodyid, gripper)

    def hardest(self, ignore_gripped: bool) -> tuple[float, str]:
        """Return the force, newtons, of the one thing that presses hardest on the robot, and words for it.

        `ignore_gripped` leaves out contacts between the fingers and any object.
        """
        contact = self._world.data.contact
        geoms: Int[np.ndarray, "c 2"] = contact.geom
        robot = self._is_robot[geoms]
        counted = robot[:, 0] != robot[:, 1]
        if not counted.any():  # in most steps
            return 0.0, ""
        counted &= contact.efc_address >= 0
        if ignore_gripped:
            finger = self._is_finger[geoms].any(axis=1)
            counted &= ~(finger & (self._world.geom_labels[geoms] >= 0).any(axis=1))
        if not counted.any():
            return 0.0, ""
        # With elliptic cones the first row of a contact is its normal force.
        forces = self._world.data.efc_force[contact.efc_address[counted]]
        pairs, on_robot = geoms[counted], robot[counted]
        others = np.where(on_robot[:, 0], pairs[:, 1], pairs[:, 0])
        bodies = self._world.model.geom_bodyid[others]
        sums = np.bincount(bodies, forces)
        worst = int(np.argmax(sums))
        at = int(np.argmax(np.where(bodies == worst, forces, -1.0)))
        pair = pairs[at] if on_robot[at, 0] else pairs[at, ::-1]
        return float(sums[worst]), " on ".join(self._world.body_name_of_geom(int(g)) for g in pair)

    def carried(self, heights_before: Float[np.ndarray, "n"], risen_m: float) -> dict[int, bool]:
        """Return lifted objects that touch the gripper, directly (True) or through others that do (False)."""
        world = self._world
        risen = (world.positions[:, 2] - heights_before > risen_m) & world.present
        geoms = world.data.contact.geom
        labels = world.geom_labels[geoms]
        gripper = self._is_gripper[geoms]
        directly = {int(b if g0 else a) for (a, b), (g0, g1) in zip(labels, gripper) if g0 != g1}
        found = {i: True for i in sorted(directly) if i >= 0 and risen[i]}
        pairs = {(int(a), int(b)) for a, b in (*labels, *labels[:, ::-1]) if a >= 0 and b >= 0}
        while more := {b for a, b in pairs if a in found and b not in found and risen[b]}:
            found.update(dict.fromkeys(sorted(more), False))
        return found


@dataclass(frozen=True)
class Overlap:
    """How deep two things are inside each other (0 or less where nothing touches), their names, and the ids of those
    that are objects.
    """

    depth_m: float
    between: tuple[str, str] = ("", "")
    object_ids: tuple[int, ...] = ()


def deepest_overlap(world: World) -> Overlap:
    """Return the two things in a world that overlap deepest now; at rest 0.2 to 0.7 mm are normal."""
    world.update_position_stage()
    contact = world.data.contact
    if len(contact.dist) == 0:
        return Overlap(0.0)
    worst = int(np.argmin(contact.dist))
    a, b = (world.body_name_of_geom(int(g)) for g in contact.geom[worst])
    labels = world.geom_labels[contact.geom[worst]]
    return Overlap(-float(contact.dist[worst]), (a, b), tuple(labels[labels >= 0].tolist()))


def lies_on(world: World) -> frozenset[tuple[int, int]]:
    """Return all pairs (upper, lower) of objects in the scene where the lower bears a tenth of the upper's weight or
    more, by the upward part of the normal forces between the two. The world is unchanged afterwards.
    """
    state = save_state(world)
    world.wake()  # between sleeping things there are no forces
    mujoco.mj_forward(world.model, world.data)
    contact, model = world.data.contact, world.model
    labels = world.geom_labels[contact.geom]
    counted = (labels >= 0).all(axis=1) & (labels[:, 0] != labels[:, 1]) & (contact.efc_address >= 0)
    # A contact's normal points from its first geom to its second, and its force pushes the two apart.
    upward_n = world.data.efc_force[contact.efc_address[counted]] * contact.frame[counted, 2]
    first, second = labels[counted].T
    restore_state(world, state)
    borne_n = np.zeros((world.object_count, world.object_count))
    np.add.at(borne_n, (second, first), np.maximum(upward_n, 0.0))
    np.add.at(borne_n, (first, second), np.maximum(-upward_n, 0.0))
    weights_n = model.body_mass[world.object_bodies] * np.linalg.norm(model.opt.gravity)
    pairs = np.argwhere(borne_n >= _BORNE_SHARE * weights_n[:, None])
    return frozenset((int(upper), int(lower)) for upper, lower in pairs)
