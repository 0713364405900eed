"""Every stage of the system that can be exchanged: what is shipped, and how others register theirs. Light to import.

A part of a user's own is named as "module:Class" or "path/to/file.py:Class", or by an entry point of the stage's group.
"""

from collections.abc import Mapping

from torc.plugins import PartKind

CAMERAS = PartKind(
    "camera",
    "torc.cameras",
    "capture()",
    {
        "simulated": "torc.sim.robot:as_simulated",
        "recorded": "torc.cameras.recorded:RecordedCamera",
    },
)
PERCEPTIONS = PartKind(
    "perception",
    "torc.perceptions",
    "perceive(observation, wanted, before)",
    {
        "labels": "torc.perception.privileged:LabelPerception",
        "embedded": "torc.perception.embedded.perception:EmbeddedPerception",
        "regions": "torc.perception.embedded.regions:RegionPerception",
    },
)
DEPTHS = PartKind(
    "depth",
    "torc.depths",
    "measure(observation)",
    {
        "as-measured": "torc.perception.protocol:AsMeasured",
        "sgbm": "torc.perception.stereo:SgbmDepth",
        "tof": "torc.perception.tof:TofDepth",
        "onnx": "torc.perception.onnx_stereo:OnnxDepth",
    },
)
GRASP_PLANNERS = PartKind(
    "grasp planner",
    "torc.grasp_planners",
    "plan(scene, volume, rng)",
    {
        "geometric": "torc.grasping.planner:GeometricGraspPlanner",
    },
)
MOTION_PLANNERS = PartKind(
    "motion planner",
    "torc.motion_planners",
    "plan_pick(request, rng)",
    {
        "sampling": "torc.motion.planner:SamplingMotionPlanner",
    },
)
TASK_PLANNERS = PartKind(
    "task planner",
    "torc.planners",
    "decide(context, rng)",
    {
        "random": "torc.task_planning.random_choice:RandomPlanner",
        "dg-select": "torc.task_planning.dg_select:DgSelectPlanner",
        "belief": "torc.task_planning.belief.planner:BeliefPlanner",
        "learned": "torc.task_planning.learned.planner:LearnedPlanner",
        "vlm-select": "torc.vlm.select:VlmSelectPlanner",
        "vlm-grasps": "torc.vlm.select:VlmGraspsPlanner",
        "vlm-fixes-dg": "torc.vlm.fixes_dg:VlmFixesDgPlanner",
    },
)
ASKING = tuple(name for name, path in TASK_PLANNERS.built_in.items() if path.startswith("torc.vlm."))
"""Names of the task planners that come with torc and ask a model: they take a `client`."""

STAGES: Mapping[str, PartKind] = {
    "camera": CAMERAS,
    "perception": PERCEPTIONS,
    "depth": DEPTHS,
    "grasps": GRASP_PLANNERS,
    "motion": MOTION_PLANNERS,
}
"""The stages around the task planner, as `Conditions` name them."""
CONFIGURED: Mapping[str, str] = {
    "noise": "torc.perception.noise:stereo_camera",
    "occlusion": "torc.occlusion.volume:FIXED_CAMERA",
    "failures": "torc.pipeline.failures:FailureConfig",
    "bets": "torc.pipeline.better_bet:BetConfig",
    "simulation": "torc.sim.robot:SimulatedRobotConfig",
}
"""What cannot be exchanged, but has settings: name -> the default, or what makes it."""
