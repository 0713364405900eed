"""Settings of motion planning, in metres, radians, seconds."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class CartesianConfig:
    """Straight-line motions to and from the grasp.

    Attributes:
        back_offs_m: distances of the pre-grasp from the grasp, against the approach direction; the first one that is
            feasible and free is taken.
        lifts_m: heights of the lift; the first one at whose end nothing is touched is taken, else the highest.
        line_out_m: longest line against the approach out of a narrow place, if no free motion leads into or out of it.
        step_m: distance between waypoints of a line.
        max_branches: inverse-kinematics solutions of a grasp followed along both lines at a time.
        max_rounds: most rounds of `max_branches` before the grasp is given up.
        max_joint_step_rad: a larger change of a joint between two waypoints is a jump.
        limit_margin_rad: distance to the joint limits.
        approach_speed_m_s, lift_speed_m_s: largest speed of the TCP.
    """

    back_offs_m: tuple[float, ...] = (0.09, 0.07, 0.05, 0.035)
    lifts_m: tuple[float, ...] = (0.10, 0.14, 0.18, 0.07, 0.05)
    line_out_m: float = 0.30
    step_m: float = 0.005
    max_branches: int = 12
    max_rounds: int = 4
    max_joint_step_rad: float = 0.15
    limit_margin_rad: float = 0.01
    approach_speed_m_s: float = 0.15
    lift_speed_m_s: float = 0.2


@dataclass(frozen=True)
class SearchConfig:
    """Free motions.

    Attributes:
        max_iterations: samples drawn before a query is given up. An infeasible query costs all of them.
        range_rad: longest edge of the trees.
        goals: inverse-kinematics solutions offered as goals of one query.
        shortcut_rounds: attempted shortcuts of a path.
        blend_rad: corners are rounded within this distance.
        refinements: how often the search for a path that grazes an obstacle is repeated with half the step.
        grazing_m: how far a trajectory may enter the paddings.
        room_m: extra room to fixed boxes on the way to the pre-grasp, if such a motion is found, and as far as its ends
            have it.
    """

    max_iterations: int = 1500
    range_rad: float = 1.2
    goals: int = 6
    shortcut_rounds: int = 40
    blend_rad: float = 0.35
    refinements: int = 2
    grazing_m: float = 0.003
    room_m: float = 0.008


@dataclass(frozen=True)
class TimingConfig:
    """Time parametrisation.

    Attributes:
        sample_s: time between samples of a trajectory.
        grid_points: least number along the path. Coarser grids give far too slow trajectories.
        speed_scale, acceleration_scale: share of the joints' limits that is used.
    """

    sample_s: float = 0.01
    grid_points: int = 200
    speed_scale: float = 0.9
    acceleration_scale: float = 0.9


@dataclass(frozen=True)
class MotionConfig:
    """All settings of `SamplingMotionPlanner`.

    Attributes:
        max_grasps: grasps tried, best first. A look follows the straight ways of as many grasps of an object.
        opening_m: opening of the gripper until it closes on the object; None for fully open.
        carve_margin_m: room cleared around a configuration that must be free although voxels say otherwise.
        drop_yaws: directions of the gripper over the bin, evenly spread.
        drop_raises_m: heights added to the drop position; the first that has a solution is taken.
        attached_spheres: most spheres that stand for a held object.
    """

    max_grasps: int = 8
    opening_m: float | None = None
    carve_margin_m: float = 0.012
    drop_yaws: int = 12
    drop_raises_m: tuple[float, ...] = (0.0, 0.06, 0.12)
    attached_spheres: int = 40
    cartesian: CartesianConfig = field(default_factory=CartesianConfig)
    search: SearchConfig = field(default_factory=SearchConfig)
    timing: TimingConfig = field(default_factory=TimingConfig)
