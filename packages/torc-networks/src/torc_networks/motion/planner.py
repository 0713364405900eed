"""The motion planner `curobo`: free motions by a server; approach, lift and everything else as in `sampling`."""

from dataclasses import dataclass, field

import numpy as np

from torc.motion.config import MotionConfig
from torc.motion.free_motions import FreeMotions
from torc.motion.mover import Mover
from torc.motion.protocol import NoMotionError
from torc.motion.sampling_planner import SamplingMotionPlanner
from torc.motion.space import MotionQuery
from torc.records import PlanStage, Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc.workspace.description import Workspace
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient
from torc_networks.fields import read_motion
from torc_networks.motion.checking import UnusableMotionError, stays_free, usable_trajectory
from torc_networks.motion.world import world_fields


@dataclass(frozen=True)
class CuroboConfig(MotionConfig):
    """The server's address; the rest is as in `sampling`, of which `search` decides how many goals are offered."""

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5558"))


class CuroboMotionPlanner(SamplingMotionPlanner):
    """Plans picks as `sampling` does, except the free motions (as the paper uses cuRobo)."""

    def __init__(
        self, robot: RobotDescription, workspace: Workspace, config: CuroboConfig | None = None
    ) -> None:
        asked = CuroboConfig() if config is None else config
        super().__init__(robot, workspace, asked)
        self.free = NetworkFreeMotions(self.mover, workspace, asked)


class NetworkFreeMotions(FreeMotions):
    """Free motions that a server plans; each is checked before it is used."""

    def __init__(self, mover: Mover, workspace: Workspace, config: CuroboConfig) -> None:
        super().__init__(mover, workspace)
        self.client = NetworkClient(config.server)

    def _motion(
        self, query: MotionQuery, stage: PlanStage, rng: np.random.Generator
    ) -> tuple[Trajectory, int]:
        """Return a free motion to one of the goals, and which.

        Raises NoMotionError if the server finds none, or one that touches something by torc's own check; NetworkError,
        also for a motion that was not asked for.
        """
        arm = self._mover.arm
        index = query.by_time()[: self._config.search.goals]
        answer = self.client.ask(
            "plan",
            start=query.start,
            goals=query.goals[index],
            joint_names=list(arm.joint_names),
            T_world_tool0=tool0_poses(arm, query.start[None])[0],
            seed=int(rng.integers(1 << 31)),
            **world_fields(query.space),
        )
        found = read_motion(answer, arm.dof)
        if isinstance(found, str):
            raise NoMotionError(stage, f"no free path was found for the {stage}: {found}")
        try:
            trajectory, chosen = usable_trajectory(found, query.among(index), arm, self._config)
        except UnusableMotionError as error:
            raise answer.refuse(str(error)) from error
        if not stays_free(trajectory, query.space, self._config.search.grazing_m):
            raise NoMotionError(stage, f"the path that the server found for the {stage} touches something.")
        return trajectory, int(index[chosen])
