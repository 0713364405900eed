"""What trials must share, besides the problem, to be compared: robot, grasp planner, noise, the limit on p."""

from pathlib import Path

from pydantic import BaseModel, ConfigDict

from torc.fingerprints import part_source
from torc.grasping.names import DEFAULT_GRASPS
from torc.grasping.registry import GRASP_PLANNERS
from torc.pipeline.min_score import DEFAULT_MIN_SCORE
from torc.plugins import load_part
from torc.robots.loading import own_source
from torc.robots.names import DEFAULT_ROBOT

_DIGITS = 8


class Conditions(BaseModel):
    """What spec.json of a trial says of them.

    Attributes:
        noise, robot, min_score, grasps: as in `TrialSpec`.
        robot_source, grasps_source: fingerprints of what does not come with torc; "" else.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    noise: bool = False
    robot: str = DEFAULT_ROBOT
    robot_source: str = ""
    min_score: float = DEFAULT_MIN_SCORE
    grasps: str = DEFAULT_GRASPS
    grasps_source: str = ""

    @property
    def text(self) -> str:
        """What is not as by default, in words: trials with the same text can be compared."""
        told = ["noise"] if self.noise else []
        if self.robot != DEFAULT_ROBOT:
            told.append(_signed(f"robot {Path(self.robot).stem}", self.robot_source))
        if self.min_score != DEFAULT_MIN_SCORE:
            told.append(f"min_score {self.min_score:g}")
        if self.grasps != DEFAULT_GRASPS:
            told.append(_signed(f"grasps {self.grasps}", self.grasps_source))
        return ", ".join(told)


def sources(robot: str, grasps: str) -> dict[str, str]:
    """The fingerprints of a robot and a grasp planner as `Conditions` have them. Raises InputError for unknown ones."""
    own = grasps != DEFAULT_GRASPS
    return {
        "robot_source": own_source(robot),
        "grasps_source": part_source(load_part(GRASP_PLANNERS, grasps)) if own else "",
    }


def _signed(what: str, source: str) -> str:
    return f"{what} ({source[:_DIGITS]})" if source else what
