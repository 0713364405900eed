"""What an episode carries from one pick to the next, and the random streams of its stages."""

import zlib
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from torc.occlusion.volume import empty_volume
from torc.pipeline.failures import FailedGrasp
from torc.records import OcclusionVolume, PickOutcome, PickResult, SegmentedScene, VoxelGrid


def stage_rng(seed: int, pick: int, stage: str) -> np.random.Generator:
    """Return the generator for one stage of one pick.

    Streams are independent of each other, so a stage that draws more numbers changes no other stage.
    """
    return np.random.default_rng([seed, pick, zlib.crc32(stage.encode())])


class EndReason(StrEnum):
    """Why an episode ended."""

    RETRIEVED = "retrieved"
    BUDGET_SPENT = "budget spent"
    TARGET_LOST = "target lost"
    WRONG_OBJECT = "wrong object"
    """The robot delivered something else and took it for the target."""
    NOTHING_LEFT = "nothing left to try"
    GAVE_UP = "gave up"


@dataclass(frozen=True)
class EpisodeState:
    """Everything that an episode knows between two picks; with the state of the world it decides all that follows.

    Attributes:
        volume, scene: from the latest look.
        outcomes: the true ones; planners receive what the robot felt.
    """

    volume: OcclusionVolume
    failed: tuple[FailedGrasp, ...] = ()
    outcomes: tuple[PickOutcome, ...] = ()
    scene: SegmentedScene | None = None

    @property
    def pick(self) -> int:
        """Number of the next pick, counted from 0."""
        return len(self.outcomes)

    @property
    def dropped(self) -> tuple[int, ...]:
        """Ids of the objects other than the target that have fallen off the table."""
        return tuple(k for outcome in self.outcomes for k in outcome.dropped)

    @property
    def end(self) -> EndReason | None:
        """Why the latest pick ended the episode; None while it goes on."""
        if not self.outcomes:
            return None
        if self.outcomes[-1].target_lost:
            return EndReason.TARGET_LOST
        if self.outcomes[-1].wrong_object:
            return EndReason.WRONG_OBJECT
        return EndReason.RETRIEVED if self.outcomes[-1].result is PickResult.RETRIEVED else None


def first_state(grid: VoxelGrid) -> EpisodeState:
    """Return the state before the first look: nothing seen, nothing tried."""
    return EpisodeState(empty_volume(grid))
