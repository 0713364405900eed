"""The shipped parts between camera and task planner."""

from torc.grasping.names import DEFAULT_GRASPS
from torc.grasping.registry import make_grasp_planner
from torc.occlusion.volume import FIXED_CAMERA, FIXED_REAL_CAMERA
from torc.perception.noise import stereo_camera
from torc.perception.privileged import REAL_CAMERA, LabelPerception
from torc.pipeline.look import Pipeline
from torc.pipeline.min_score import DEFAULT_MIN_SCORE
from torc.robots.description import RobotDescription
from torc.scenes.workspace import Workspace


def default_pipeline(
    robot: RobotDescription,
    workspace: Workspace,
    *,
    noise: bool = False,
    min_score: float = DEFAULT_MIN_SCORE,
    grasps: str = DEFAULT_GRASPS,
) -> Pipeline:
    """The shipped parts for a robot at a workspace, with the noise of a stereo camera or without any.

    Args:
        robot, workspace: who sees and grasps what.
        noise: add that noise.
        min_score: see `Pipeline`.
        grasps: the grasp planner, see `make_grasp_planner`.

    Raises InputError for a `min_score` that is no probability, and for a grasp planner that cannot be made.
    """
    return Pipeline(
        perception=LabelPerception(REAL_CAMERA if noise else None),
        grasp_planner=make_grasp_planner(grasps, robot.gripper, workspace.support_z_m),
        robot=robot,
        workspace=workspace,
        noise=stereo_camera() if noise else None,
        occlusion=FIXED_REAL_CAMERA if noise else FIXED_CAMERA,
        min_score=min_score,
    )
