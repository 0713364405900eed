"""Play an episode: one pick after another until the target is out (paper: A Modular Pipeline)."""

from collections.abc import Callable, Sequence

from torc.episode.events import Decided, Ended, EpisodeResult, Halted, Listener, Started
from torc.episode.steps import EpisodeConfig, Steps, checked_choice, pick_request
from torc.errors import PickHaltedError
from torc.perception.protocol import Wanted
from torc.pipeline.building import System
from torc.pipeline.look import Look
from torc.pipeline.state import EndReason, EpisodeState, first_state, stage_rng
from torc.pipeline.warm_up import rehearse_look
from torc.records import Decision, PickOutcome, PickPlan, PlanFailure
from torc.registry.kinds import MOTION_PLANNERS
from torc.robots.protocols import Robot
from torc.task_planning.protocol import TaskPlanner, ask_planner, rehearse_planner

Resume = Callable[[PickHaltedError], None]
"""Asks a person to attend to a stopped robot. Raises the error, or another, if the episode must not go on."""


class Episode:
    """One episode in progress, whoever drives it: a task planner, an environment for reinforcement learning, a person.

    `look` and `pick` take turns. Once `look` has returned None, the episode is over and `end` says why. Listeners are
    called with every event in order.
    """

    def __init__(
        self,
        robot: Robot,
        system: System,
        wanted: Wanted,
        config: EpisodeConfig,
        listeners: Sequence[Listener] = (),
    ) -> None:
        self.steps = Steps(robot, system, wanted, config, listeners)
        self.state: EpisodeState = first_state(system.pipeline.workspace.grid)
        self.end: EndReason | None = None
        self._halts: list[str] = []

    def rehearse(self, planner: TaskPlanner | None = None) -> Look:
        """Run every kernel of the parts once on a made-up scene, and return its look.

        What is compiled or loaded now takes no planning time later.
        """
        steps = self.steps
        look = rehearse_look(steps.system.pipeline, steps.robot.description.arm.rest_qpos)
        for object_id in look.context.scene.ids[:1]:
            MOTION_PLANNERS.traits(steps.system.motion_planner).warm_up(pick_request(look, object_id))
        if planner is not None:
            rehearse_planner(planner, look.context)
        return look

    def look(self) -> Look | None:
        """Return the look before the next pick; None if the episode has ended. Raises TorcError if a part failed."""
        if self.end is None and self.state.pick >= self.steps.config.max_picks:
            self.end = EndReason.BUDGET_SPENT
        if self.end is not None:
            return None
        look = self.steps.look(self.state)
        if not look.context.scene.objects:
            self.end = EndReason.NOTHING_LEFT
            return None
        return look

    def decide(self, planner: TaskPlanner, look: Look) -> Decision:
        """Return a planner's decision about the latest look.

        Raises PlannerError if it crashed or its answer is invalid.
        """
        pick = self.state.pick
        with self.steps.clock.stage("decide") as lap:
            decision = ask_planner(planner, look.context, stage_rng(self.steps.config.seed, pick, "decide"))
        self.steps.tell(Decided(pick, look, decision, lap.seconds))
        return decision

    def plan(self, look: Look, decision: Decision) -> PickPlan | PlanFailure | PickOutcome:
        """Return the motions that `pick` would execute, why there are none, or a lost pick for a bad decision.

        Nothing moves.
        """
        choice = checked_choice(look, decision)
        return choice if isinstance(choice, PickOutcome) else self.steps.plan(self.state, look, choice)

    def pick(self, look: Look, decision: Decision) -> None:
        """Carry out a decision about the latest look. One that cannot be tried is a lost pick; giving up is not a pick.

        Raises:
            PickHaltedError: the robot was stopped; the pick does not count, and another look may follow.
            PhysicsError: the simulation broke.
            TorcError: another part failed.
        """
        if decision.give_up:
            self.end = EndReason.GAVE_UP
            return
        try:
            self.state = self.steps.attempt(self.state, look, decision)
        except PickHaltedError as error:
            self._halts.append(str(error))
            self.steps.tell(Halted(self.state.pick, str(error)))
            raise
        self.end = self.state.end

    def result(self) -> EpisodeResult:
        """Return the outcome. Raises ValueError while the episode goes on."""
        if self.end is None:
            raise ValueError("The episode has not ended.")
        outcomes = self.state.outcomes
        return EpisodeResult(
            retrieved=self.end is EndReason.RETRIEVED,
            held_target=any(o.held_target for o in outcomes),
            end=self.end,
            outcomes=outcomes,
            seconds=dict(self.steps.clock.seconds),
            halts=tuple(self._halts),
        )


def run_episode(
    episode: Episode, planner: TaskPlanner, started: Started, resume: Resume | None = None
) -> EpisodeResult:
    """Pick until the target is retrieved or lost, the budget is spent, or nothing is left to try.

    Args:
        episode: the episode, before its first look.
        planner: decides each pick.
        started: the first event.
        resume: called after a halt; without it the halt is raised.

    Raises:
        TorcError: a part failed; the trial is errored and has no result.
    """
    episode.steps.tell(started)
    while (look := episode.look()) is not None:
        decision = episode.decide(planner, look)
        try:
            episode.pick(look, decision)
        except PickHaltedError as error:
            if resume is None:
                raise
            resume(error)
    result = episode.result()
    episode.steps.tell(Ended(result))
    return result
