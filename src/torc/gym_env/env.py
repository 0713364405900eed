"""The environment `torc/Retrieval-v0`: a step is one pick of the real pipeline, the action names the object."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Bool, Float32, Int8, UInt8

from torc.drawing.marking import mark_image
from torc.episode.loop import Episode
from torc.episode.simulated import episode_in, needs_color, simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, PhysicsError, UnknownNameError
from torc.occlusion.volume import hidden_volumes_m3
from torc.pipeline.building import build_system
from torc.pipeline.look import Look
from torc.pipeline.state import EndReason
from torc.pipeline.warm_up import announced_compilation
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import MAX_OBJECTS, Decision, GraspStatus, PlanningContext
from torc.sim.rendering import Closing
from torc.sim.robot import RobotState, SimulatedRobot
from torc.specs.conditions import Conditions
from torc.task_planning.graph_building import build_dependency_graph
from torc.workspace.workspace_files import load_workspace

SHARES = ("best_score", "pixels", "hidden_volume", "blocked", "tried")
PER_OBJECT = ("visible", "graspable", "target", *SHARES, "position")
"""The keys with a row per object id; "position" has three columns."""


def observed(context: PlanningContext, max_picks: int) -> dict[str, np.ndarray]:
    """Return a look's features by the keys of the observation space, which docs/learning.md explains."""
    scene, report, grasps, ids = context.scene, context.report, context.grasps, list(context.scene.ids)
    rows: dict[str, np.ndarray] = {
        "visible": _ones(ids),
        "graspable": action_mask(context),
        "target": _ones([scene.target_number]),
        **{name: np.zeros(MAX_OBJECTS, np.float32) for name in SHARES},
        "position": np.zeros((MAX_OBJECTS, 3), np.float32),
        "edges": np.zeros((MAX_OBJECTS, MAX_OBJECTS), np.float32),
        "picks_left": np.array([context.picks_left / max_picks], np.float32),
    }
    for edge in build_dependency_graph(context).edges:
        rows["edges"][edge.source, edge.target] = edge.weight
    unseen = max(1, int(np.count_nonzero(~context.volume.seen)))
    grid = context.volume.grid
    rows["hidden_volume"][ids] = hidden_volumes_m3(context.volume, ids) / (unseen * grid.voxel_size_m**3)
    for o in scene.objects:
        of = grasps.object_ids == o.id
        valid = grasps.scores[of & (report.status == GraspStatus.VALID)]
        rows["best_score"][o.id] = valid.max(initial=0.0)
        rows["pixels"][o.id] = o.pixel_count / scene.label_image.size
        if len(o.points):  # their middle, -1 to 1 along each side of the workspace
            share = (o.points.mean(axis=0) - grid.origin) / (grid.upper - grid.origin)
            rows["position"][o.id] = np.clip(2.0 * share - 1.0, -1.0, 1.0)
        if of.any():
            rows["blocked"][o.id] = report.blocked_total[report.object_ids.index(o.id)] / np.count_nonzero(of)
    for object_id, times in Counter(outcome.object_id for outcome in context.history).items():
        if object_id >= 0:
            rows["tried"][object_id] = times / max_picks
    return rows


def action_mask(context: PlanningContext) -> Int8[np.ndarray, "64"]:
    """Return 1 for the objects that can be picked now; if nothing can, all are 0 and every action is a lost pick."""
    return _ones(list(context.report.graspable_ids))


def stacked(observation: dict[str, np.ndarray]) -> Float32[np.ndarray, "64 f"]:
    """Return the per-object features of an observation side by side, for a network that looks at one object at a time.

    The columns are those of PER_OBJECT and, last, the weight of the edge that the target has to the object.
    """
    columns = [observation[key].reshape(MAX_OBJECTS, -1) for key in PER_OBJECT]
    return np.hstack([*columns, observation["edges"][observation["target"].argmax()][:, None]]).astype(
        np.float32
    )


def _ones(ids: list[int]) -> Int8[np.ndarray, "64"]:
    flags = np.zeros(MAX_OBJECTS, np.int8)
    flags[ids] = 1
    return flags


RESET_OPTIONS = ("problem", "episode_seed")
_SEEDS = 2**31
_NO_EPISODE = "There is no episode in progress: call reset() first."


class EpisodeSimulation(Closing):
    """Episodes with the parts of `run_trial`: equal problem, seed and picks give equal episodes.

    The world of the latest problem is kept, so that another episode in it need not build it anew.
    """

    def __init__(self, conditions: Conditions, *, color: bool) -> None:
        """Build the parts. Without `color`, if no pictures are needed, each look is faster. Raises InputError."""
        self._system = build_system(conditions)
        self._color = color or needs_color(self._system)
        self._open: tuple[str, SimulatedRobot, RobotState] | None = None  # problem, robot, state as built
        self._rehearsed = False

    def begin(self, problem: str, config: EpisodeConfig) -> Episode:
        """Return the episode of a problem, before its first look; the previous one is over.

        The first call compiles kernels that are not cached, and says so on stderr. Raises InputError for a problem that
        cannot be used, and PhysicsError if it breaks before the first pick.
        """
        if self._open is None or self._open[0] != problem:
            self.close()
            simulated = simulated_robot(self._system, load_problem(problem), color=self._color)
            self._open = problem, simulated, simulated.save()
        _, simulated, built = self._open
        simulated.restore(built)
        simulated.take_over()
        episode = episode_in(simulated, self._system, config)
        if not self._rehearsed:
            with announced_compilation():
                episode.rehearse()
            self._rehearsed = True
        return episode

    def close(self) -> None:
        """Free the world and its camera."""
        if self._open is not None:
            self._open[1].close()
            self._open = None


class RetrievalEnv(gymnasium.Env[dict[str, np.ndarray], np.int64]):
    """Retrieve the target: every step looks, picks the object that the action names, and looks again.

    docs/learning.md describes observations, rewards and ends.

    Args:
        problems: as `torc problems list` names them: sets, problems, files, directories; comma-separated or a sequence.
        image: also observe the marked image.
        pick_cost: of each attempt, failed ones included, and of each that is left when an episode ends without the
            target: losing the target must not save picks.
        drop_cost: of each object that falls off the table.
        retrieval_bonus: for the target.
        render_mode: None, or "rgb_array" for the robot's camera.
        simulation: begins the episodes; by default an `EpisodeSimulation` of these conditions.
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
        known = [*Conditions.__dataclass_fields__]
        for name in conditions.keys() - known:
            raise UnknownNameError("argument of the environment", name, known)
        chosen = Conditions(**conditions)
        self.problems = select_problems(problems if isinstance(problems, str) else ",".join(problems))
        self.max_picks, self.image, self.render_mode = chosen.max_picks, image, render_mode
        self.pick_cost, self.drop_cost, self.retrieval_bonus = pick_cost, drop_cost, retrieval_bonus
        color = image or render_mode is not None
        self._simulation = EpisodeSimulation(chosen, color=color) if simulation is None else simulation
        self.action_space = spaces.Discrete(MAX_OBJECTS)
        n, mount = MAX_OBJECTS, load_workspace(chosen.workspace).camera
        found: dict[str, spaces.Space[Any]] = {
            **{key: spaces.MultiBinary(n) for key in ("visible", "graspable", "target")},
            **{key: spaces.Box(0.0, 1.0, (n,), np.float32) for key in SHARES},
            "edges": spaces.Box(0.0, 1.0, (n, n), np.float32),
            "picks_left": spaces.Box(0.0, 1.0, (1,), np.float32),
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
        """Begin an episode; its problem and seed are drawn from the environment's own generator.

        Args:
            seed: seeds that generator.
            options: "problem" and "episode_seed" replace the draws: `torc run PROBLEM --seed N` with the same picks
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
        # Both are drawn whatever the options, so that these shift no later draw.
        problem = self.problems[int(self.np_random.integers(len(self.problems)))]
        episode_seed = int(self.np_random.integers(_SEEDS))
        problem = str(options.get("problem", problem))
        episode_seed = options.get("episode_seed", episode_seed)
        if not isinstance(episode_seed, int) or episode_seed < 0:
            raise InputError(f"The episode's seed is {episode_seed!r}; it must be an integer, at least 0.")
        self._facts = {"problem": problem, "episode_seed": episode_seed}
        # Whatever fails from here on, the previous episode is over.
        self._episode, self._look = None, None
        episode = self._simulation.begin(problem, EpisodeConfig(self.max_picks, episode_seed))
        look = episode.look()
        if look is None:
            raise InputError(f"Problem '{problem}': nothing is in sight at the start. Choose another.")
        self._episode, self._look = episode, look
        return self._observation(look), self._info(look)

    def step(self, action: np.int64 | int) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Pick the object of that id. An object that cannot be picked is a lost pick, as for a task planner.

        Raises InputError without an episode in progress or for an action that is not an object id, and another
        TorcError if a part failed, except by broken physics, which truncates the episode.
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
        """Return which objects can be picked now, as sb3-contrib's maskable agents need it."""
        if self._look is None:
            raise InputError(_NO_EPISODE)
        return action_mask(self._look.context).astype(bool)

    def render(self) -> UInt8[np.ndarray, "h w 3"] | None:
        """Return the picture of the robot's camera at the latest look."""
        if self.render_mode is None:
            return None
        if self._look is None:
            raise InputError(_NO_EPISODE)
        return self._look.context.scene.observation.rgb

    def close(self) -> None:
        """Free the simulation."""
        self._simulation.close()
        self._episode, self._look = None, None

    def _observation(self, look: Look) -> dict[str, np.ndarray]:
        observation = observed(look.context, self.max_picks)
        return observation | ({"image": mark_image(look.context.scene)} if self.image else {})

    def _info(self, look: Look) -> dict[str, Any]:
        return {**self._facts, "pick": len(look.context.history), "action_mask": action_mask(look.context)}
