"""Settings of grasp planning. Lengths are in metres, angles in radians."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from torc.registry.settings import ConfigTraits


@dataclass(frozen=True)
class CloudConfig:
    """How the clouds are thinned out and completed.

    Attributes:
        voxel_m: one averaged point per object and cube of this edge.
        neighbour_voxel_m: edge of the cubes in the cloud that is searched for *other* objects.
        cell_m: edge of the cells that neighbours are looked up in.
        min_pixels: objects with fewer visible pixels get no grasps.
        max_hidden_depth_m: assumed largest depth of an object along the viewing ray, unless more is seen. For hands
            that open further than a 2F-85 it grows with the opening.
        min_hidden_depth_m, depth_per_height: its depth is at least this, or this times its height.
    """

    voxel_m: float = 0.004
    neighbour_voxel_m: float = 0.006
    cell_m: float = 0.025
    min_pixels: int = 60
    max_hidden_depth_m: float = 0.075
    min_hidden_depth_m: float = 0.020
    depth_per_height: float = 1.5


@dataclass(frozen=True)
class CandidateConfig:
    """Which candidates are proposed.

    Attributes:
        tilts_rad: angles of the approach from straight down, which is always included.
        yaws_rad: yaws of tilted approaches about the vertical, from the camera's forward direction.
        max_yaw_rad: no generator approaches further from forward than this.
        slice_m: distance between slices.
        depths_m: how far the fingertips reach below the top of a slice.
        min_depth_m: candidates that are shallower after being raised off the table are dropped.
        spread_m: an object must be narrower than the opening by this to be centred between the fingers.
        gap_m: in objects that are too wide, parts separated by this much along the closing axis are grasped one by one
            (rims, handles).
        closing_merge_rad: closing axes closer than this are merged.
        normal_clusters: most closing axes taken from clusters of surface normals.
        max_frames: pairs of approach and closing axis that are sliced per object, drawn at random if there are more;
            those straight down always are.
        slices_per_frame: slices per pair, spread over the object.
        max_raw: candidates examined per object and generator, drawn at random if there are more.
        max_blocked: candidates per object that touch other objects and are examined further, drawn at random.
        target_effort: factor on max_raw and max_frames for the target: a single grasp of it ends the trial, and it
            often has only one or two.
    """

    tilts_rad: tuple[float, ...] = tuple(np.deg2rad([25.0, 50.0, 70.0, 85.0]).tolist())
    yaws_rad: tuple[float, ...] = tuple(np.deg2rad([0.0, 30.0, -30.0, 60.0, -60.0]).tolist())
    max_yaw_rad: float = float(np.deg2rad(72.0))
    slice_m: float = 0.011
    depths_m: tuple[float, ...] = (0.016, 0.028, 0.045)
    min_depth_m: float = 0.006
    spread_m: float = 0.006
    gap_m: float = 0.012
    closing_merge_rad: float = float(np.deg2rad(12.0))
    normal_clusters: int = 6
    max_frames: int = 100
    slices_per_frame: int = 4
    max_raw: int = 120
    max_blocked: int = 80
    target_effort: int = 8

    def for_target(self) -> "CandidateConfig":
        """Return the settings for the target, which is worth more effort."""
        effort = self.target_effort
        return replace(self, max_raw=effort * self.max_raw, max_frames=effort * self.max_frames)


@dataclass(frozen=True)
class CheckConfig:
    """Hard checks of a candidate, on the gripper at its largest opening.

    Attributes:
        finger_margin_m: distance that other objects must keep from the volume the fingers sweep.
        palm_margin_m: distance that any point must keep from the rest of the gripper.
        own_slack_m: points of the object this far outside the closed jaws do not count as inside a finger.
        table_margin_m: distance of every part of the gripper to the support.
        tip_margin_m: distance of the fingertips to the support.
        approach_m: length of the straight approach within which the fingers must not pass through the object.
        min_points_between: fewest points of the object between the pads.
        max_foreign_between: most points of other objects between the pads.
        max_own_in_fingers: most points of the object inside the fingers (stray points).
        max_foreign_touching: most points of other objects in the fingers' sweep or the palm (stray points).
    """

    finger_margin_m: float = 0.003
    palm_margin_m: float = 0.003
    own_slack_m: float = 0.003
    table_margin_m: float = 0.003
    tip_margin_m: float = 0.005
    approach_m: float = 0.08
    min_points_between: int = 6
    max_foreign_between: int = 3
    max_own_in_fingers: int = 0
    max_foreign_touching: int = 0


@dataclass(frozen=True)
class SelectionConfig:
    """Which candidates are returned.

    Attributes:
        max_per_object: grasps per object.
        spare: factor on that number until it is known which are free.
        min_blocked_share: share reserved for grasps whose gripper touches other objects, if there are any.
        position_m, angle_rad: a grasp is a duplicate of a better one if the pads are closer than this and both approach
            and closing axis differ by less.
    """

    max_per_object: int = 48
    spare: int = 3
    min_blocked_share: float = 0.2
    position_m: float = 0.012
    angle_rad: float = float(np.deg2rad(18.0))


@dataclass(frozen=True)
class GraspConfig(ConfigTraits):
    """All settings of `GeometricGraspPlanner`.

    Attributes:
        rough_depth: depth has a sensor's errors; the score is calibrated for that.
    """

    clouds: CloudConfig = field(default_factory=CloudConfig)
    candidates: CandidateConfig = field(default_factory=CandidateConfig)
    checks: CheckConfig = field(default_factory=CheckConfig)
    selection: SelectionConfig = field(default_factory=SelectionConfig)
    rough_depth: bool = False

    @classmethod
    def rough(cls) -> Self:
        """Return the settings for depth with a sensor's errors."""
        return cls(rough_depth=True)


@dataclass(frozen=True)
class ValidityConfig:
    """Settings of `validity.evaluate_grasps`.

    Attributes:
        max_branches: inverse-kinematics branches tried per grasp, best first; more than 16 hardly ever help.
        branch_rounds: they are tried in rounds up to these numbers; grasps with a free branch leave.
        blocked_branches: branches examined per grasp without a free one, to see what is in the way.
        checks: thresholds on points between and in the fingers.
        clouds: how the scene's clouds are thinned out for that.
    """

    max_branches: int = 24
    branch_rounds: tuple[int, ...] = (1, 3, 8)
    blocked_branches: int = 6
    checks: CheckConfig = field(default_factory=CheckConfig)
    clouds: CloudConfig = field(default_factory=CloudConfig)
