"""Check whether a settled scene stays still: slow topples and creeping piles show only after seconds."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.sim.settling import run
from torc.sim.simulated_world import World


@dataclass(frozen=True)
class StillnessConfig:
    """When a scene counts as still.

    Attributes:
        distance_m, angle_rad: no object may move or turn further from where it was at the start.
        early_s: after this time the watch ends as soon as every object's motion so far, plus `safety` times the
            expected rest at the pace of the last `pace_s`, is within the limits.
    """

    distance_m: float = 0.002
    angle_rad: float = float(np.deg2rad(2.0))
    seconds: float = 10.0
    check_s: float = 0.25
    early_s: float = np.inf
    pace_s: float = 1.0
    safety: float = 3.0


@dataclass(frozen=True)
class StillnessReport:
    """A scene left to itself: how far each object moved and turned (0 if not present), and which left the table."""

    still: bool
    watched_s: float
    distances_m: Float[np.ndarray, "n"]
    angles_rad: Float[np.ndarray, "n"]
    left: tuple[int, ...]

    @property
    def distance_m(self) -> float:
        """The largest distance."""
        return float(self.distances_m.max(initial=0.0))

    @property
    def angle_rad(self) -> float:
        """The largest angle."""
        return float(self.angles_rad.max(initial=0.0))


def watch_stillness(world: World, config: StillnessConfig | None = None) -> StillnessReport:
    """Run a world until an object has moved too far, or the time is up. Raises PhysicsError."""
    config = config or StillnessConfig()
    began, positions, wxyz, on_table = world.time_s, world.positions, world.wxyz, set(world.on_table())
    limits = np.array([config.distance_m, config.angle_rad])
    every = max(1, round(config.pace_s / config.check_s))
    history = [np.zeros((2, world.object_count))]
    watched = 0.0
    still, left = True, tuple[int, ...]()
    while still and watched < config.seconds - 1e-9:
        run(world, min(config.check_s, config.seconds - watched))
        watched += min(config.check_s, config.seconds - watched)
        moved = _moved(world, positions, wxyz)
        left = tuple(sorted(on_table - set(world.on_table())))
        still = bool((moved <= limits[:, None]).all()) and not left
        history.append(moved)
        if watched >= config.early_s and len(history) > every:
            pace = np.abs(moved - history[-1 - every]).max(axis=1) / config.pace_s
            expected = moved.max(axis=1) + config.safety * pace * (config.seconds - watched)
            if (expected <= limits).all():
                break
    world.update_position_stage()
    return StillnessReport(still, world.time_s - began, history[-1][0], history[-1][1], left)


def _moved(
    world: World, positions: Float[np.ndarray, "n 3"], wxyz: Float[np.ndarray, "n 4"]
) -> Float[np.ndarray, "2 n"]:
    """Return distance and angle of each object from where it was."""
    cosine = np.clip(np.abs(np.sum(world.wxyz * wxyz, axis=1)), 0.0, 1.0)
    moved = np.stack([np.linalg.norm(world.positions - positions, axis=1), 2.0 * np.arccos(cosine)])
    return np.where(world.present, moved, 0.0)
