"""The episode: one pick after another until the target is out (paper: A Modular Pipeline)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from torc.episode.events import (
    Decided,
    Ended,
    EndReason,
    EpisodeResult,
    Event,
    Executed,
    Listener,
    Looked,
    Planned,
    Started,
)
from torc.motion.protocol import MotionPlanner, PickRequest
from torc.occlusion.volume import empty_volume
from torc.pipeline.failures import FailedGrasp
from torc.pipeline.look import Look, Pipeline
from torc.pipeline.seeding import stage_rng
from torc.pipeline.timing import StageClock
from torc.records import (
    TARGET_ID,
    Decision,
    GraspStatus,
    OcclusionVolume,
    PickOutcome,
    PickPlan,
    PickResult,
    PlanFailure,
)
from torc.robots.protocols import Robot
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.protocol import TaskPlanner


@dataclass(frozen=True)
class EpisodeConfig:
    """Attributes:
    max_picks: attempts, failed ones included (paper: 15).
    seed: decides all random draws.
    """

    max_picks: int = 15
    seed: int = 0


@dataclass(frozen=True)
class EpisodeParts:
    """Who does what; each can be exchanged."""

    robot: Robot
    pipeline: Pipeline
    task_planner: TaskPlanner
    motion_planner: MotionPlanner


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


def rehearse(parts: EpisodeParts) -> None:
    """Use every kernel once, to no effect: what is compiled now does not count as planning time later."""
    episode = _Episode(parts, "", EpisodeConfig(), ())
    look = episode.look(0)
    DgSelectPlanner().decide(look.context, stage_rng(0, 0, "rehearsal"))
    for object_id in look.context.report.graspable_ids[:1]:
        episode.plan(0, look, object_id)


class _Episode:
    """The state of one episode: the occlusion volume and the outcomes so far."""

    def __init__(
        self,
        parts: EpisodeParts,
        target_description: str,
        config: EpisodeConfig,
        listeners: Sequence[Listener],
    ) -> None:
        self.parts, self.config, self.listeners = parts, config, listeners
        self.target_description = target_description
        self.volume: OcclusionVolume = empty_volume(parts.pipeline.workspace.grid)
        self.outcomes: tuple[PickOutcome, ...] = ()
        self.failed: tuple[FailedGrasp, ...] = ()
        self.clock = StageClock()

    def tell(self, event: Event) -> None:
        for listener in self.listeners:
            listener(event)

    def run(self) -> EpisodeResult:
        for pick in range(self.config.max_picks):
            end = self.one_pick(pick)
            if end is not None:
                return self.result(end)
        return self.result(EndReason.BUDGET_SPENT)

    def one_pick(self, pick: int) -> EndReason | None:
        """One attempt; a reason if it ends the episode."""
        look = self.look(pick)
        if not look.context.scene.objects:
            return EndReason.NOTHING_LEFT
        decision = self.decide(pick, look)
        if decision.give_up:
            return EndReason.GAVE_UP
        outcome = self.attempt(pick, look, decision)
        self.outcomes += (outcome,)
        if outcome.target_lost:
            return EndReason.TARGET_LOST
        return EndReason.RETRIEVED if outcome.result is PickResult.RETRIEVED else None

    def look(self, pick: int) -> Look:
        with self.clock.stage("look") as lap:
            look = self.parts.pipeline.look(
                self.parts.robot.capture(),
                self.volume,
                target_description=self.target_description,
                seed=self.config.seed,
                history=tuple(map(unprivileged, self.outcomes)),
                picks_left=self.config.max_picks - pick,
                failed=self.failed,
            )
        self.volume = look.context.volume
        self.clock.add(look.seconds)
        self.tell(Looked(pick, look, lap.seconds))
        return look

    def decide(self, pick: int, look: Look) -> Decision:
        with self.clock.stage("decide") as lap:
            decision = self.parts.task_planner.decide(
                look.context, stage_rng(self.config.seed, pick, "decide")
            )
        self.tell(Decided(pick, look, decision, lap.seconds))
        return decision

    def attempt(self, pick: int, look: Look, decision: Decision) -> PickOutcome:
        """Plan and execute; a lost pick where there is nothing to execute."""
        choice = checked_choice(look, decision)
        outcome, seconds = (
            (choice, 0.0) if isinstance(choice, PickOutcome) else self.pick_up(pick, look, choice)
        )
        self.tell(Executed(pick, outcome, seconds))
        return outcome

    def pick_up(self, pick: int, look: Look, object_id: int) -> tuple[PickOutcome, float]:
        """What came of it, and the seconds that the robot took."""
        plan, seconds = self.plan(pick, look, object_id), 0.0
        if isinstance(plan, PlanFailure):
            outcome = PickOutcome(PickResult.NO_PLAN, object_id, detail=f"{plan.stage}: {plan.reason}")
        else:
            with self.clock.stage("execute") as lap:
                outcome = self.parts.robot.execute(plan)
            seconds = lap.seconds
        self.failed = remembered(self.failed, look, plan, outcome)
        return outcome, seconds

    def plan(self, pick: int, look: Look, object_id: int) -> PickPlan | PlanFailure:
        context = look.context
        request = PickRequest(
            scene=context.scene,
            volume=context.volume,
            world=look.world,
            grasps=context.grasps,
            report=context.report,
            object_id=object_id,
            qpos_start=context.scene.observation.qpos,
        )
        with self.clock.stage("plan motions") as lap:
            plan = self.parts.motion_planner.plan_pick(request, stage_rng(self.config.seed, pick, "motion"))
        self.tell(Planned(pick, look, plan, lap.seconds))
        return plan

    def result(self, end: EndReason) -> EpisodeResult:
        return EpisodeResult(
            retrieved=end is EndReason.RETRIEVED,
            held_target=any(
                o.held_after_lift and o.held_id == o.object_id == TARGET_ID for o in self.outcomes
            ),
            end=end,
            outcomes=self.outcomes,
            seconds=dict(self.clock.seconds),
        )


def remembered(
    failed: tuple[FailedGrasp, ...], look: Look, plan: PickPlan | PlanFailure, outcome: PickOutcome
) -> tuple[FailedGrasp, ...]:
    """The failed grasps to remember after this attempt.

    A motion of the robot may have made ways free, so that only the executed failures stay after one.
    """
    if isinstance(plan, PickPlan):
        failed = tuple(f for f in failed if f.executed)
    if outcome.delivered:
        return failed
    grasps, report = look.context.grasps, look.context.report
    seen_at = look.context.scene.object(outcome.object_id).points.mean(axis=0)
    if isinstance(plan, PickPlan):
        tried = [plan.grasp_index]
    else:
        valid = grasps.of(outcome.object_id)
        tried = valid[report.status[valid] == GraspStatus.VALID][: plan.grasps_tried].tolist()
    executed = isinstance(plan, PickPlan)
    return failed + tuple(
        FailedGrasp(outcome.object_id, grasps.Ts_world_tcp[g], seen_at, executed) for g in tried
    )


def unprivileged(outcome: PickOutcome) -> PickOutcome:
    """What a real robot would know of an outcome: not which unseen object it touched, held by mistake, or dropped."""
    held_id = outcome.object_id if outcome.held_after_lift else None
    return replace(outcome, held_id=held_id, dropped=(), detail="")


def checked_choice(look: Look, decision: Decision) -> int | PickOutcome:
    """The object to try, or the lost pick if the decision cannot be tried.

    As the authors count: "no valid grasp" if nothing in sight has one, "no valid choice" if the planner named
    nothing, an object that is not in sight, or one without a valid grasp while others have one.
    """
    report, chosen = look.context.report, decision.object_id
    if not report.graspable_ids:
        detail = "No object in sight has a valid grasp."
        return PickOutcome(PickResult.NO_VALID_GRASP, -1 if chosen is None else chosen, detail=detail)
    if chosen is None:
        return PickOutcome(PickResult.NO_VALID_CHOICE, -1, detail=decision.reason)
    if not report.has_valid_grasp(chosen):
        return PickOutcome(PickResult.NO_VALID_CHOICE, chosen, detail=f"Object {chosen} has no valid grasp.")
    return chosen
