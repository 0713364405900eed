"""`torc warm-up`: compile all kernels once."""

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class WarmUpCommand:
    """Compile the numerical kernels now, so that no later command waits for them: some minutes, once.

    They are cached on disk, beside the program or in your home directory (the environment variable NUMBA_CACHE_DIR
    names another place). Run it again after an upgrade of torc or numba. An arm of your own may need one more kernel,
    if its inverse kinematics have no closed form.
    """

    def run(self) -> int:
        from torc.episode.steps import pick_request
        from torc.pipeline.building import build_system
        from torc.pipeline.planners import make_planner
        from torc.pipeline.warm_up import rehearse_look
        from torc.registry.kinds import MOTION_PLANNERS
        from torc.robots.names import robot_names
        from torc.specs.conditions import Conditions
        from torc.task_planning.protocol import rehearse_planner
        from torc.trials.pick_view import view_of

        begin, planners = time.monotonic(), ("dg-select", "belief", "learned")
        played = {robot: Conditions(robot=robot) for robot in robot_names()}
        played["own eyes"] = Conditions(perception="embedded", depth="sgbm")
        played["noise"] = Conditions(noise=True)
        total = len(played) + len(planners)
        for number, (name, conditions) in enumerate(played.items(), 1):
            print(f"{number}/{total}  {name} ...", flush=True)
            system = build_system(conditions)
            look = rehearse_look(system.pipeline, system.robot.arm.rest_qpos)
            view_of(look.context)
            for object_id in look.context.scene.ids[:1]:
                MOTION_PLANNERS.traits(system.motion_planner).warm_up(pick_request(look, object_id))
        for number, name in enumerate(planners, len(played) + 1):
            print(f"{number}/{total}  {name} ...", flush=True)
            rehearse_planner(make_planner(name), look.context)
        print(f"Done in {time.monotonic() - begin:.0f} s: all kernels are compiled and cached.")
        return 0
