"""From a grasp planner's name to a grasp planner.

Other packages add names by an entry point of the group "torc.grasp_planners", or are named directly as "module:Class".
"""

from types import MappingProxyType

from torc.grasping.names import DEFAULT_GRASPS
from torc.grasping.protocol import GraspPlanner
from torc.plugins import PartKind, make_part
from torc.robots.description import GripperDescription

GRASP_PLANNERS = PartKind(
    "grasp planner",
    "torc.grasp_planners",
    "plan(scene, volume, rng)",
    MappingProxyType({DEFAULT_GRASPS: "torc.grasping.planner:GeometricGraspPlanner"}),
)


def make_grasp_planner(name: str, gripper: GripperDescription, support_z_m: float) -> GraspPlanner:
    """The grasp planner of that name, or the class at "module:Class".

    Args:
        name: which.
        gripper: handed to a class that has a parameter `gripper`.
        support_z_m: height of the table top, world, handed to a class that has a parameter `support_z_m`.

    Raises UnknownNameError for a name nobody registered, and InputError where the class cannot be imported, needs
    other arguments, or makes no grasp planner; the cause is in the text.
    """
    offered = {"gripper": gripper, "support_z_m": support_z_m}
    planner: GraspPlanner = make_part(GRASP_PLANNERS, name, {}, offered)
    return planner
