"""All handlers of torc's own parts, by action; each is made at its first request: some take seconds to load."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from torc.errors import UnknownNameError
from torc.robots.description import RobotDescription
from torc.workspace.description import Workspace
from torc_networks.server import Handler

ACTIONS = ("segment", "stereo", "infer", "grasps", "plan")
"""What torc can serve: masks; disparities; grasps as GraspGen, and as Contact-GraspNet gives them; free motions."""


def own_handlers(
    robot: RobotDescription, workspace: Workspace, actions: tuple[str, ...] = ACTIONS
) -> dict[str, Handler]:
    """The handlers of these actions. Raises UnknownNameError for one that there is not."""
    for name in actions:
        if name not in ACTIONS:
            raise UnknownNameError("action", name, [*ACTIONS])
    makers = {
        "segment": lambda: _segment(workspace),
        "stereo": _stereo,
        "infer": lambda: _grasps(robot, workspace)["infer"],
        "grasps": lambda: _grasps(robot, workspace)["grasps"],
        "plan": lambda: _plan(robot),
    }
    return {name: _when_asked(makers[name]) for name in actions}


def _when_asked(make: Callable[[], Handler]) -> Handler:
    made = cache(make)

    def handler(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        return made()(asked)

    return handler


def _segment(workspace: Workspace) -> Handler:
    from torc_networks.serving.seeing import segment_handler

    return segment_handler(workspace)


def _stereo() -> Handler:
    from torc.perception.stereo import SgbmConfig
    from torc_networks.serving.seeing import stereo_handler

    return stereo_handler(SgbmConfig())


def _grasps(robot: RobotDescription, workspace: Workspace) -> Mapping[str, Handler]:
    from torc_networks.serving.grasping import grasp_handlers

    return grasp_handlers(robot.gripper, workspace)


def _plan(robot: RobotDescription) -> Handler:
    from torc.motion.config import MotionConfig
    from torc_networks.serving.planning import plan_handler

    return plan_handler(robot, MotionConfig())
