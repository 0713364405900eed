"""The environment as an embodiment of inspect-robots: a step is one pick, the action is the number of the object.

inspect-robots run --task torc_retrieval --embodiment torc --policy POLICY
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from inspect_robots.embodiment import PRIVILEGED_SUCCESS, RENDERABLE, RESETTABLE, SEEDABLE, EmbodimentInfo
from inspect_robots.scene import Scene
from inspect_robots.spaces import (
    ActionSemantics,
    Box,
    CameraSpec,
    ObservationSpace,
    StateField,
    StateSpec,
)
from inspect_robots.task import Task
from inspect_robots.types import Action, Observation, StepResult

from torc.gym_env.env import RetrievalEnv
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import MAX_OBJECTS

CAMERA = "marked"
_DOCS = """One step is one whole pick: the arm takes the object whose number the action names, and puts it into a bin.
The action `object_number` is the number in the black square on that object in the camera's picture, rounded to a whole
number; it is no motion of the arm. The target is number 0, in sight or not. `graspable` says for each number whether
the arm has a grasp for it now; any other choice is a lost pick. The episode ends when the target is in the bin or lost,
or when no pick is left. Use as few picks as possible."""


class TorcEmbodiment:
    """An arm with a two-finger gripper over a cluttered table, simulated. Scenes name a problem in their metadata.

    Args:
        max_picks: picks of an episode, failed ones included.
        conditions: what is around the agent, see `Conditions`.
    """

    def __init__(self, *, max_picks: int = 15, **conditions: Any) -> None:
        self._env = RetrievalEnv(image=True, max_picks=max_picks, **conditions)
        height, width, channels = self._env.observation_space["image"].shape  # type: ignore[index]
        self.info = EmbodimentInfo(
            name="torc",
            action_space=Box(
                shape=(1,),
                low=np.zeros(1),
                high=np.full(1, MAX_OBJECTS - 1.0),
                # There is no mode for a choice: it is given as a target, any of which may follow any other.
                semantics=ActionSemantics(
                    control_mode="eef_abs_pose", dim_labels=("object_number",), max_step=(MAX_OBJECTS - 1.0,)
                ),
            ),
            observation_space=ObservationSpace(
                cameras=(CameraSpec(CAMERA, height, width, channels),),
                state=StateSpec(
                    (
                        StateField("last_object", (1,)),
                        StateField("picks_left_share", ()),
                        StateField("visible", (MAX_OBJECTS,)),
                        StateField("graspable", (MAX_OBJECTS,)),
                    )
                ),
            ),
            is_simulated=True,
            capabilities=frozenset({SEEDABLE, RESETTABLE, PRIVILEGED_SUCCESS, RENDERABLE}),
            docs=_DOCS,
        )

    def reset(self, scene: Scene, *, seed: int | None = None) -> Observation:
        """Begin the retrieval of the scene's problem. Raises InputError for one that cannot be played."""
        options: dict[str, Any] = {"problem": scene.metadata.get("problem", scene.id)}
        if seed is not None:
            options["episode_seed"] = int(seed)
        seen, _ = self._env.reset(options=options)
        return _observation(seen, -1, scene.instruction)

    def step(self, action: Action) -> StepResult:
        """Pick. A number that names no object is a lost pick; a simulation that broke raises, and so is no failure of
        the policy's.
        """
        number = int(np.clip(np.rint(action.data[0]), 0, MAX_OBJECTS - 1))
        seen, reward, terminated, truncated, info = self._env.step(number)
        if "error" in info:
            raise RuntimeError(f"The simulation broke: {info['error']}")
        reason = ("success" if info["is_success"] else info["end"]) if terminated else None
        facts = {name: info[name] for name in ("result", "picks", "drops") if name in info}
        return StepResult(
            observation=_observation(seen, number, None),
            reward=float(reward),
            terminated=terminated,
            termination_reason=reason,
            truncated=truncated,
            info=facts | {"success": bool(info.get("is_success", False))},
        )

    def close(self) -> None:
        """Free the simulation."""
        self._env.close()


def retrieval_task(problems: str | Sequence[str] = "torc40", max_steps: int = 15) -> Task:
    """One scene per problem; scored by success and by the picks that it took."""
    names = select_problems(problems if isinstance(problems, str) else ",".join(problems))
    scenes = [
        Scene(
            id=name,
            instruction=f"Retrieve the target, number 0: {load_problem(name).description}. Use few picks.",
            init_seed=0,
            metadata={"problem": name},
        )
        for name in names
    ]
    scorers = ["success_at_end", "episode_length"]
    return Task(name="torc_retrieval", scenes=scenes, scorer=scorers, max_steps=max_steps)


def _observation(seen: dict[str, np.ndarray], last: int, instruction: str | None) -> Observation:
    return Observation(
        images={CAMERA: seen["image"]},
        state={
            "last_object": np.array([float(last)]),
            "picks_left_share": seen["picks_left"].astype(float).reshape(()),
            "visible": seen["visible"].astype(float),
            "graspable": seen["graspable"].astype(float),
        },
        instruction=instruction,
    )
