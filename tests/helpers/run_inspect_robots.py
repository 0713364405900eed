"""Runs in the environment of inspect-robots: the embodiment `torc` with a policy that picks what can be grasped.

python -m tests.helpers.run_inspect_robots PROBLEM LOGS
"""

import json
import sys

import numpy as np
from inspect_robots.conformance import check_embodiment
from inspect_robots.eval import eval as run_eval
from inspect_robots.policy import PolicyConfig, PolicyInfo
from inspect_robots.registry import registered, resolve
from inspect_robots.types import Action, ActionChunk


class Graspable:
    """The target if it can be picked, else the object with the highest number that can."""

    config = PolicyConfig()

    def __init__(self, space):
        self.info = PolicyInfo(name="graspable", action_space=space)
        self.seen = []

    def reset(self, scene):
        """Nothing to forget."""

    def act(self, observation):
        """One pick."""
        free = np.flatnonzero(observation.state["graspable"])
        self.seen.append(
            [list(observation.images["marked"].shape), float(observation.state["last_object"][0])]
        )
        chosen = 0 if not len(free) or free[0] == 0 else int(free[-1])
        return ActionChunk([Action(np.array([float(chosen)]))])


def main(problem: str, logs: str) -> None:
    """Print what came of one retrieval."""
    embodiment = resolve("embodiment", "torc", max_picks=6)
    task = resolve("task", "torc_retrieval", problems=problem, max_steps=6)
    policy = Graspable(embodiment.info.action_space)
    (log,) = run_eval(task, policy, embodiment, log_dir=logs)
    embodiment.close()
    told = {
        "conformant": check_embodiment(embodiment.info).ok,
        "registered": "torc" in registered("embodiment"),
        "status": log.status,
        "results": str(log.results),
        "seen": policy.seen,
    }
    print(json.dumps(told))


if __name__ == "__main__":
    main(*sys.argv[1:])
