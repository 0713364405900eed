"""The two halves of a pick, looking and trying, as functions of the episode's state."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from torc.episode.events import Event, Executed, Listener, Looked, Planned
from torc.episode.held import HeldLook
from torc.episode.identity import true_ids
from torc.grasping.reasons import why_none_is_valid
from torc.motion.protocol import PickRequest, ask_motion_planner
from torc.perception.checked_scenes import ask_camera
from torc.perception.protocol import Wanted
from torc.pipeline.building import System
from torc.pipeline.failures import FailedGrasp
from torc.pipeline.look import Look, StageClock
from torc.pipeline.state import EpisodeState, stage_rng
from torc.pipeline.touch import touched_points
from torc.records import (
    MAX_OBJECTS,
    Decision,
    GraspStatus,
    PickOutcome,
    PickPlan,
    PickResult,
    PlanFailure,
)
from torc.registry.kinds import PERCEPTIONS
from torc.robots.description import RobotDescription
from torc.robots.protocols import KnowsObjects, Robot


@dataclass(frozen=True)
class EpisodeConfig:
    """The number of attempts, failed ones included (paper: 15), and the seed of all random draws."""

    max_picks: int = 15
    seed: int = 0


class Steps:
    """Looks and tries with a robot and the parts of a system. Keeps nothing of the episode but the time spent.

    Only the robot's world is not in the state: `attempt` changes it.
    """

    def __init__(
        self,
        robot: Robot,
        system: System,
        wanted: Wanted,
        config: EpisodeConfig,
        listeners: Sequence[Listener] = (),
    ) -> None:
        """Take the parts; `listeners` are called with every look, plan and execution."""
        self.robot, self.system, self.wanted, self.config = robot, system, wanted, config
        self.clock, self._listeners = StageClock(), tuple(listeners)

    def tell(self, event: Event) -> None:
        """Call the listeners."""
        for listener in self._listeners:
            listener(event)

    def look(self, state: EpisodeState) -> Look:
        """Return what the robot sees now, and what follows from it."""
        with self.clock.stage("capture") as lap:
            capture = ask_camera(self.robot)
        look = self.system.pipeline.look(
            capture, state, wanted=self.wanted, seed=self.config.seed, picks_left=self._left(state)
        )
        self.clock.add(look.seconds)
        self.tell(Looked(state.pick, look, lap.seconds + sum(look.seconds.values()), state))
        return look

    def looks(self, state: EpisodeState, seeds: Iterable[int]) -> Iterator[Look]:
        """Yield a look with the grasps that each seed draws, all from one snapshot, taken when the first is requested.

        Listeners do not hear of them.
        """
        pipeline, wanted = self.system.pipeline, self.wanted
        view = pipeline.view(ask_camera(self.robot), state, wanted=wanted, seed=self.config.seed)
        for seed in seeds:
            yield pipeline.look_at(view, state, wanted=wanted, seed=seed, picks_left=self._left(state))

    def _left(self, state: EpisodeState) -> int:
        return self.config.max_picks - state.pick

    def plan(self, state: EpisodeState, look: Look, object_id: int) -> PickPlan | PlanFailure:
        """Return the motions of a pick, or why there are none."""
        with self.clock.stage("plan motions") as lap:
            rng = stage_rng(self.config.seed, state.pick, "motion")
            plan = ask_motion_planner(self.system.motion_planner, pick_request(look, object_id), rng)
        self.tell(Planned(state.pick, look, plan, lap.seconds))
        return plan

    def attempt(self, state: EpisodeState, look: Look, decision: Decision) -> EpisodeState:
        """Return the state after planning and executing a decision; a lost pick if there is nothing to execute."""
        choice, failed, seconds = checked_choice(look, decision), state.failed, 0.0
        truth, scene = true_ids(look), look.context.scene
        if isinstance(choice, PickOutcome):
            outcome = choice
        else:
            plan = self.plan(state, look, choice)
            if isinstance(plan, PlanFailure):
                outcome = PickOutcome(PickResult.NO_PLAN, choice, detail=f"{plan.stage}: {plan.reason}")
            else:
                # Ids that perception was given are the truth, whatever the planner says.
                named = decision.is_target and not look.ids_given
                meant = replace(plan, is_target=named or choice == scene.target_id)
                # A planner that names the target is trusted; otherwise the lifted object is looked at.
                check = None if named else self._held_look(state, look, choice)
                with self.clock.stage("execute") as lap:
                    if isinstance(self.robot, KnowsObjects):
                        self.robot.aim_at(truth.get(choice))
                    outcome = self.robot.execute(meant, check)
                seconds, outcome = lap.seconds, replace(outcome, as_target=meant.is_target)
                if named:
                    scene = scene.with_target(choice)
                elif check is not None and check.p is not None:
                    outcome = replace(outcome, target_p=check.p)
                    if not check.is_target:
                        if outcome.as_felt.delivered:
                            scene = scene.with_brought(choice, check.p)
                        if meant.is_target:
                            scene = scene.with_target(None)
            failed = remembered(failed, look, plan, outcome.as_felt, self.robot.description)
        self.tell(Executed(state.pick, outcome, seconds))
        return EpisodeState(look.context.volume, failed, (*state.outcomes, outcome), scene)

    def _held_look(self, state: EpisodeState, look: Look, object_id: int) -> HeldLook | None:
        """Return the check of that object once it is lifted; None if perception does not recognise held objects."""
        pipeline, robot = self.system.pipeline, self.robot.description
        if PERCEPTIONS.traits(pipeline.perception).recognise is None:
            return None
        rng = stage_rng(self.config.seed, state.pick, "held")
        return HeldLook(pipeline, robot, look, self.wanted, object_id, rng)


def pick_request(look: Look, object_id: int) -> PickRequest:
    """Return the motion planner's request for an object."""
    context = look.context
    return PickRequest(
        scene=context.scene,
        volume=context.volume,
        world=look.world,
        grasps=context.grasps,
        report=context.report,
        object_id=object_id,
        qpos_start=context.scene.observation.qpos,
    )


def remembered(
    failed: tuple[FailedGrasp, ...],
    look: Look,
    plan: PickPlan | PlanFailure,
    outcome: PickOutcome,
    robot: RobotDescription,
) -> tuple[FailedGrasp, ...]:
    """Return the failed grasps to remember after this attempt.

    A motion of the robot may have cleared paths, so only executed failures remain after one. A grasp on the way to
    which the robot was stopped was not tried: the next plan draws another path to it. If an object has no plan for a
    second time, and nothing moved in between, the failure stands for all its grasps. `outcome` is as felt.
    """
    executed = isinstance(plan, PickPlan)
    if executed:
        failed = tuple(f for f in failed if f.executed)
    if outcome.delivered or outcome.result is PickResult.NOT_REACHED:
        return failed
    grasps, report = look.context.grasps, look.context.report
    seen_at = look.context.scene.object(outcome.object_id).points.mean(axis=0)
    if isinstance(plan, PickPlan):
        tried = [plan.grasp_index]
    else:
        valid = grasps.of(outcome.object_id)
        tried = valid[report.status[valid] == GraspStatus.VALID][: plan.grasps_tried].tolist()
    again = not executed and any(f.object_id == outcome.object_id and not f.executed for f in failed)
    touched = touched_points(outcome.touch, robot, look.context.volume)
    return failed + tuple(
        FailedGrasp(outcome.object_id, grasps.Ts_world_tcp[g], seen_at, executed, touched, again)
        for g in tried
    )


def checked_choice(look: Look, decision: Decision) -> int | PickOutcome:
    """Return the object to try, or the lost pick if the decision cannot be tried.

    As the authors count: "no valid grasp" if nothing in sight has one, "no valid choice" if the planner named nothing,
    an object that is not in sight, or one without a valid grasp while others have one.
    """
    report, chosen = look.context.report, decision.object_id
    named = (
        -1 if chosen is None or not 0 <= chosen < MAX_OBJECTS else chosen
    )  # an impossible id is not logged as one
    if not report.graspable_ids:
        return PickOutcome(PickResult.NO_VALID_GRASP, named, detail=why_none_is_valid(report))
    if chosen is None:
        return PickOutcome(PickResult.NO_VALID_CHOICE, named, detail=decision.reason)
    if chosen not in look.context.scene.ids:
        detail = f"Object {chosen} is not in sight; {', '.join(map(str, look.context.scene.ids))} are."
        return PickOutcome(PickResult.NO_VALID_CHOICE, named, detail=detail)
    if not report.has_valid_grasp(chosen):
        return PickOutcome(PickResult.NO_VALID_CHOICE, named, detail=f"Object {chosen} has no valid grasp.")
    return chosen
