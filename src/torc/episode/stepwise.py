"""An episode that somebody else drives: look, then a pick, until it has ended.

`run_episode` drives it with a task planner; an environment for reinforcement learning drives it with actions.
"""

from torc.episode.events import EpisodeResult
from torc.episode.state import EndReason, EpisodeState, first_state
from torc.episode.steps import Steps
from torc.pipeline.look import Look
from torc.records import TARGET_ID, Decision


class Episode:
    """One episode in progress: what it knows, and whether and why it has ended.

    `look` and `pick` take turns. Once `look` has answered None, the episode is over and `end` says why.

    Attributes:
        steps: looks and picks, with the parts and the budget.
        state: what is carried from one pick to the next.
        end: why the episode ended; None while it goes on.
    """

    def __init__(self, steps: Steps) -> None:
        self.steps = steps
        self.state: EpisodeState = first_state(steps.parts.pipeline.workspace.grid)
        self.end: EndReason | None = None

    def look(self) -> Look | None:
        """The look before the next pick; None if there is none, because the episode has ended.

        Raises:
            TorcError: a part failed.
        """
        if self.end is None and self.state.pick >= self.steps.config.max_picks:
            self.end = EndReason.BUDGET_SPENT
        if self.end is not None:
            return None
        look = self.steps.look(self.state)
        if not look.context.scene.objects:
            self.end = EndReason.NOTHING_LEFT
            return None
        return look

    def pick(self, look: Look, decision: Decision) -> None:
        """Carry out a decision about the latest look. One that cannot be tried is a lost pick; giving up is none.

        Raises:
            PhysicsError: the simulation broke.
            TorcError: another part failed.
        """
        if decision.give_up:
            self.end = EndReason.GAVE_UP
            return
        self.state = self.steps.attempt(self.state, look, decision)
        self.end = self.state.end

    def result(self) -> EpisodeResult:
        """The outcome. Raises ValueError while the episode goes on."""
        if self.end is None:
            raise ValueError("The episode has not ended.")
        outcomes = self.state.outcomes
        return EpisodeResult(
            retrieved=self.end is EndReason.RETRIEVED,
            held_target=any(o.held_after_lift and o.held_id == o.object_id == TARGET_ID for o in outcomes),
            end=self.end,
            outcomes=outcomes,
            seconds=dict(self.steps.clock.seconds),
        )
