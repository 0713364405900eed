"""The episode: one pick after another until the target is out (paper: A Modular Pipeline)."""

from collections.abc import Sequence

from torc.episode.events import Decided, Ended, EpisodeResult, Event, Listener, Started
from torc.episode.steps import EpisodeConfig, PickParts, Steps, pick_request
from torc.perception.protocol import Wanted
from torc.pipeline.look import Look
from torc.pipeline.state import EndReason, EpisodeState, first_state, stage_rng
from torc.pipeline.warm_up import rehearse_look
from torc.plugins import warm_up
from torc.records import TARGET_ID, Decision
from torc.task_planning.checked_decisions import ask_planner, rehearse_planner
from torc.task_planning.protocol import TaskPlanner


class Episode:
    """One episode in progress, which somebody drives: a task planner, or an environment for reinforcement learning.

    `look` and `pick` take turns. Once `look` has answered None, the episode is over and `end` says why.
    """

    def __init__(self, steps: Steps) -> None:
        self.steps = steps
        self.state: EpisodeState = first_state(steps.parts.pipeline.workspace.grid)
        self.end: EndReason | None = None

    def look(self) -> Look | None:
        """The look before the next pick; None if the episode has ended. Raises TorcError if a part failed."""
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

        Raises PhysicsError if the simulation broke, and another TorcError if another part failed.
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
            held_target=any(o.held_after_lift and o.held_id == o.meant_id == TARGET_ID for o in outcomes),
            end=self.end,
            outcomes=outcomes,
            seconds=dict(self.steps.clock.seconds),
        )


def run_episode(
    parts: PickParts,
    planner: TaskPlanner,
    started: Started,
    listeners: Sequence[Listener] = (),
    wanted: Wanted | None = None,
) -> EpisodeResult:
    """Pick until the target is retrieved or lost, the budget is spent, or nothing is left to try.

    The listeners are called with every event in order, `started` first; `wanted` is the target, if there is more to say
    than its description. Raises the TorcErrors of the parts: the trial is errored, no result.
    """

    def tell(event: Event) -> None:
        for listener in listeners:
            listener(event)

    tell(started)
    config = EpisodeConfig(started.max_picks, started.seed)
    episode = Episode(Steps(parts, wanted or Wanted(started.target_description), config, tell))
    while (look := episode.look()) is not None:
        pick = episode.state.pick
        with episode.steps.clock.stage("decide") as lap:
            decision = ask_planner(planner, look.context, stage_rng(started.seed, pick, "decide"))
        tell(Decided(pick, look, decision, lap.seconds))
        episode.pick(look, decision)
    result = episode.result()
    tell(Ended(result))
    return result


def rehearse(parts: PickParts, planner: TaskPlanner | None = None) -> Look:
    """Use every kernel of the parts once, on a made-up scene, whose look is returned: what is compiled or loaded now is
    no planning time.
    """
    look = rehearse_look(parts.pipeline, parts.robot.description.arm.rest_qpos)
    for object_id in look.context.scene.ids[:1]:
        warm_up(parts.motion_planner, pick_request(look, object_id))
    if planner is not None:
        rehearse_planner(planner, look.context)
    return look
