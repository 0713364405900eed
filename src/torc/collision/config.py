"""Settings of the collision checks."""

from dataclasses import dataclass

from torc.errors import InputError


@dataclass(frozen=True)
class CollisionConfig:
    """How much room to keep. A negative value lets the spheres dip into the obstacle.

    Attributes:
        padding_m: growth of the arm's spheres against voxels and fixed boxes. 10 mm by default: unpadded,
            half of the planned paths touch the true meshes; with 10 mm, 2-4 % do.
        gripper_padding_m: the same for palm and fingers against voxels; small, since grasps live in tight
            clutter and a voxel is already up to 10 mm larger than the surface in it.
        gripper_static_padding_m: the same against table and bin; fingertips 5 mm above the table must pass.
        attached_padding_m: growth of an attached object's spheres against voxels.
        attached_static_padding_m: the same against table and bin: in the hand an object shifts by some millimetres,
            and one that touches the table is torn out of it.
        self_padding_m: growth of one of two spheres of the robot itself.
        edge_step_m: no point of the robot moves further between two checked configurations of an edge. With
            edge_step_m <= 2 * padding_m the unpadded arm is free on the whole edge.
        explained_margin_m: background surface voxels this close to a fixed box show that box and are no
            obstacle of their own.
    """

    padding_m: float = 0.010
    gripper_padding_m: float = 0.002
    gripper_static_padding_m: float = 0.002
    attached_padding_m: float = 0.0
    attached_static_padding_m: float = 0.01
    self_padding_m: float = 0.0
    edge_step_m: float = 0.01
    explained_margin_m: float = 0.015

    def __post_init__(self) -> None:
        if self.edge_step_m <= 0:
            raise InputError("CollisionConfig.edge_step_m must be positive.")
