"""The environment `torc/Retrieval-v0`: a step is one pick of the real pipeline, the action names the object."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Bool, UInt8

from torc.episode.loop import Episode
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, PhysicsError, UnknownNameError
from torc.gym_env.features import SHARES, action_mask, observed
from torc.gym_env.simulation import EpisodeSimulation
from torc.perception.marking import mark_image
from torc.pipeline.look import Look
from torc.pipeline.state import EndReason
from torc.problems.sets import select_problems
from torc.records import MAX_OBJECTS, Decision
from torc.specs.conditions import Conditions
from torc.workspace.files import load_workspace

RESET_OPTIONS = ("problem", "episode_seed")
_SEEDS = 2**31
_NO_EPISODE = "There is no episode in progress: call reset() first."


class RetrievalEnv(gymnasium.Env[dict[str, np.ndarray], np.int64]):
    """Retrieve the target: every step looks, picks the object that the action names, and looks again.

    docs/gym.md describes observations, rewards and ends.

    Args:
        problems: as `torc problems list` names them: sets, problems, files, directories; comma-separated or a sequence.
        image: also observe the marked image.
        pick_cost: of each attempt, failed ones included, and of each that is left when an episode ends without the
            target: to lose the target is no way to save picks.
        drop_cost: of each object that falls off the table.
        retrieval_bonus: for the target.
        render_mode: None, or "rgb_array" for the robot's camera.
        simulation: begins the episodes; an `EpisodeSimulation` of these conditions if not given.
        conditions: what is around the agent (max_picks, noise, robot, perception, settings, ...), see `Conditions`.

    Raises:
        InputError: an argument or a problem cannot be used.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012 - Gymnasium's own form

    def __init__(
        self,
        problems: str | Sequence[str] = "torc40",
        *,
        image: bool = False,
        pick_cost: float = 1.0,
        drop_cost: float = 0.2,
        retrieval_bonus: float = 10.0,
        render_mode: str | None = None,
        simulation: Any = None,
        **conditions: Any,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise InputError(f"The render mode '{render_mode}' is none of this environment: 'rgb_array' is.")
        if not min(pick_cost, drop_cost, retrieval_bonus) >= 0:
            raise InputError(
                "pick_cost, drop_cost and retrieval_bonus must be at least 0; costs are subtracted."
            )
        for name in conditions:
            if name not in Conditions.__dataclass_fields__:
                raise UnknownNameError(
                    "argument of the environment", name, [*Conditions.__dataclass_fields__]
                )
        chosen = Conditions(**conditions)
        self.problems = select_problems(problems if isinstance(problems, str) else ",".join(problems))
        self.max_picks, self.image, self.render_mode = chosen.max_picks, image, render_mode
        self.pick_cost, self.drop_cost, self.retrieval_bonus = pick_cost, drop_cost, retrieval_bonus
        color = image or render_mode is not None
        self._simulation = EpisodeSimulation(chosen, color=color) if simulation is None else simulation
        self.action_space = spaces.Discrete(MAX_OBJECTS)
        n, mount = MAX_OBJECTS, load_workspace(chosen.workspace).camera
        shapes: dict[str, tuple[int, ...]] = {
            **dict.fromkeys(SHARES, (n,)),
            "edges": (n, n),
            "picks_left": (1,),
        }
        found: dict[str, spaces.Space[Any]] = {
            **{key: spaces.MultiBinary(n) for key in ("visible", "graspable", "target")},
            **{key: spaces.Box(0.0, 1.0, shape, np.float32) for key, shape in shapes.items()},
            "position": spaces.Box(-1.0, 1.0, (n, 3), np.float32),
        }
        if image:
            found["image"] = spaces.Box(0, 255, (mount.height, mount.width, 3), np.uint8)
        self.observation_space = spaces.Dict(found)  # type: ignore[assignment]
        self._episode: Episode | None = None
        self._look: Look | None = None
        self._facts: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Begin an episode: problem and seed of the episode are drawn from the environment's own generator.

        Args:
            seed: seeds that generator.
            options: "problem" and "episode_seed" name them instead; `torc run PROBLEM --seed N` with the same picks
                goes the same way.

        Raises:
            InputError: an option is unknown, or the problem cannot be played.
            PhysicsError: the simulation broke before the first pick.
        """
        super().reset(seed=seed)
        options = options or {}
        for name in options:
            if name not in RESET_OPTIONS:
                raise InputError(f"reset() has no option '{name}'; it has {', '.join(RESET_OPTIONS)}.")
        # Both are drawn whatever the options, so that they shift nothing.
        problem = self.problems[int(self.np_random.integers(len(self.problems)))]
        episode_seed = int(self.np_random.integers(_SEEDS))
        problem, episode_seed = (
            str(options.get("problem", problem)),
            options.get("episode_seed", episode_seed),
        )
        if not isinstance(episode_seed, int) or episode_seed < 0:
            raise InputError(f"The episode's seed is {episode_seed!r}; it must be an integer, at least 0.")
        self._facts = {"problem": problem, "episode_seed": episode_seed}
        # Whatever fails from here on, the episode before this one is over.
        self._episode, self._look = None, None
        episode = self._simulation.begin(problem, EpisodeConfig(self.max_picks, episode_seed))
        look = episode.look()
        if look is None:
            raise InputError(f"Problem '{problem}': nothing is in sight at the start. Choose another.")
        self._episode, self._look = episode, look
        return self._observation(look), self._info(look)

    def step(self, action: np.int64 | int) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Pick the object of that id. An object that cannot be picked is a lost pick, as for a task planner.

        Raises:
            InputError: there is no episode in progress, or the action is no object id.
            TorcError: a part failed otherwise than by broken physics, which truncates the episode.
        """
        episode, look = self._episode, self._look
        if episode is None or look is None or episode.end is not None:
            raise InputError(_NO_EPISODE)
        if not self.action_space.contains(np.int64(action)):
            raise InputError(f"The action {action} is no object id: 0 to {MAX_OBJECTS - 1}.")
        self._episode = None  # in progress again only if nothing fails
        try:
            episode.pick(look, Decision(int(action), "the action"))
            # After the last pick there is nothing more to look at.
            self._look = look = episode.look() or look
        except PhysicsError as error:
            return self._observation(look), 0.0, False, True, self._info(look) | {"error": str(error)}
        self._episode = episode
        outcome, ended = episode.state.outcomes[-1], episode.end is not None
        info = self._info(look) | {"result": outcome.result.value, "dropped": list(outcome.dropped)}
        reward = -self.pick_cost - self.drop_cost * len(outcome.dropped)
        if episode.end is not None:
            retrieved = episode.end is EndReason.RETRIEVED
            left = self.max_picks - episode.state.pick
            reward += self.retrieval_bonus if retrieved else -self.pick_cost * left
            picks, drops = episode.state.pick, len(episode.state.dropped)
            info |= {"end": episode.end.value, "is_success": retrieved, "picks": picks, "drops": drops}
        return self._observation(look), reward, ended, False, info

    def action_masks(self) -> Bool[np.ndarray, "64"]:
        """Which objects can be picked now, as sb3-contrib's maskable agents ask for it."""
        if self._look is None:
            raise InputError(_NO_EPISODE)
        return action_mask(self._look.context).astype(bool)

    def render(self) -> UInt8[np.ndarray, "h w 3"] | None:
        """The picture of the robot's camera at the latest look."""
        if self.render_mode is None:
            return None
        if self._look is None:
            raise InputError(_NO_EPISODE)
        return self._look.context.scene.observation.rgb

    def close(self) -> None:
        """Frees the simulation."""
        self._simulation.close()
        self._episode, self._look = None, None

    def _observation(self, look: Look) -> dict[str, np.ndarray]:
        observation = observed(look.context, self.max_picks)
        return observation | ({"image": mark_image(look.context.scene)} if self.image else {})

    def _info(self, look: Look) -> dict[str, Any]:
        """What holds at every look."""
        return {**self._facts, "pick": len(look.context.history), "action_mask": action_mask(look.context)}
