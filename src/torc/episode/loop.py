"""The episode: one pick after another until the target is out (paper: A Modular Pipeline)."""

from collections.abc import Sequence

from torc.episode.events import Decided, Ended, EpisodeResult, Event, Listener, Started
from torc.episode.state import EndReason, first_state
from torc.episode.steps import EpisodeConfig, EpisodeParts, Steps, pick_request
from torc.pipeline.look import Look
from torc.pipeline.seeding import stage_rng
from torc.pipeline.warm_up import rehearse_look, warm_up
from torc.records import TARGET_ID, Decision
from torc.task_planning.asking import ask_planner, rehearse_planner


def run_episode(
    parts: EpisodeParts,
    started: Started,
    config: EpisodeConfig,
    listeners: Sequence[Listener] = (),
) -> EpisodeResult:
    """Pick until the target is retrieved or lost, the budget is spent, or nothing is left to try.

    Args:
        parts: robot, pipeline, task planner and motion planner.
        started: who tries what; told to the listeners first.
        config: budget and seed.
        listeners: called with every event, in order.

    Raises:
        PhysicsError and other TorcErrors of the parts: the trial is errored, no result.
    """
    episode = _Episode(parts, started.target_description, config, listeners)
    episode.tell(started)
    result = episode.run()
    episode.tell(Ended(result))
    return result


def rehearse(parts: EpisodeParts) -> Look:
    """Use every kernel of the parts once, on a made-up scene: what is compiled or loaded now is no planning time.

    Returns:
        The look at that scene, for whoever has kernels of his own to rehearse.
    """
    qpos = parts.robot.description.arm.rest_qpos
    look = rehearse_look(parts.pipeline, qpos)
    rehearse_planner(parts.task_planner, look.context)
    for object_id in look.context.scene.ids[:1]:
        warm_up(parts.motion_planner, pick_request(look, object_id))
    return look


class _Episode:
    """One episode in progress."""

    def __init__(
        self,
        parts: EpisodeParts,
        target_description: str,
        config: EpisodeConfig,
        listeners: Sequence[Listener],
    ) -> None:
        self.planner, self.config, self.listeners = parts.task_planner, config, listeners
        self.steps = Steps(parts.pick_parts, target_description, config, self.tell)
        self.state = first_state(parts.pipeline.workspace.grid)

    def tell(self, event: Event) -> None:
        for listener in self.listeners:
            listener(event)

    def run(self) -> EpisodeResult:
        while self.state.pick < self.config.max_picks:
            end = self.one_pick()
            if end is not None:
                return self.result(end)
        return self.result(EndReason.BUDGET_SPENT)

    def one_pick(self) -> EndReason | None:
        """One attempt; a reason if it ends the episode."""
        look = self.steps.look(self.state)
        if not look.context.scene.objects:
            return EndReason.NOTHING_LEFT
        decision = self.decide(look)
        if decision.give_up:
            return EndReason.GAVE_UP
        self.state = self.steps.attempt(self.state, look, decision)
        return self.state.end

    def decide(self, look: Look) -> Decision:
        pick = self.state.pick
        with self.steps.clock.stage("decide") as lap:
            decision = ask_planner(self.planner, look.context, stage_rng(self.config.seed, pick, "decide"))
        self.tell(Decided(pick, look, decision, lap.seconds))
        return decision

    def result(self, end: EndReason) -> EpisodeResult:
        outcomes = self.state.outcomes
        return EpisodeResult(
            retrieved=end is EndReason.RETRIEVED,
            held_target=any(o.held_after_lift and o.held_id == o.object_id == TARGET_ID for o in outcomes),
            end=end,
            outcomes=outcomes,
            seconds=dict(self.steps.clock.seconds),
        )
