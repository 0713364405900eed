"""Play one trial on a real robot, with the loop, log and pictures of a simulated one, and a person beside it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from torc import InputError, PickOutcome, PlannerSpec, TorcError, Trial, TrialSpec, Wanted
from torc.episode.events import Event, Listener, Planned, Started
from torc.episode.loop import Episode, run_episode
from torc.episode.steps import EpisodeConfig
from torc.pipeline.building import build_system, sources
from torc.pipeline.planners import make_spec_planner, refuse_simulated
from torc.pipeline.warm_up import announced_compilation
from torc.records import PickPlan, PlanFailure
from torc.registry.kinds import PERCEPTIONS
from torc.specs.spec_files import to_plain
from torc.task_planning.protocol import TaskPlanner
from torc.trials.log import result_facts
from torc.trials.pick_view import view_of
from torc.trials.recorder import TrialRecorder
from torc.trials.trial import recorded_trial
from torc.vlm.cache import CacheConfig
from torc_lab.checks import stretch_for
from torc_lab.devices import limits, opened_lab, planned_for
from torc_lab.lab_file import Lab
from torc_lab.person import Ask, Confirmation, Confirming, ask_in_terminal, await_rest_pose
from torc_lab.planning import LimitedMotionPlanner, guarded, tcp_ways, ways_text
from torc_lab.protocols import RobotStoppedError
from torc_lab.robot import LabRobot
from torc_lab.supervisor import SupervisedArm


@dataclass(frozen=True)
class Operation:
    """How a person takes part.

    Attributes:
        confirm: which motions need a confirmation.
        ask: asks the person a yes-or-no question.
        dry_run: only look, decide and plan once; nothing moves.
        overwrite: replace an existing results directory.
        snapshots: also save each snapshot as a record.
    """

    confirm: Confirming = "motion"
    ask: Ask = ask_in_terminal
    dry_run: bool = False
    overwrite: bool = False
    snapshots: bool = False


def lab_spec(lab: Lab, planner: PlannerSpec, seed: int = 0) -> TrialSpec:
    """Return the spec of a trial in a laboratory; the lab's name replaces the problem's."""
    return TrialSpec(f"lab-{lab.name}", planner, seed, lab.conditions)


def retrieve(
    lab: Lab,
    spec: TrialSpec,
    wanted: Wanted,
    out: Path,
    operation: Operation,
    *,
    listeners: Sequence[Listener] = (),
    vlm_cache: CacheConfig | None = None,
    say: Callable[[str], None] = print,
) -> Trial:
    """Play one trial on the robot of a lab file, and write its directory.

    A lost device makes the trial "errored", never a failed pick. If the robot is stopped, the pick has no result. If a
    person then resumes, the episode goes on, and the trial is recorded, but not scored ("interrupted"). Ctrl-C stops
    the arm, waits until it rests, and ends the trial.

    Args:
        wanted: the target.
        out: directory for the results.
        listeners: receive the episode's events, in addition to the recorder.
        vlm_cache: how to cache a model's answers; None for no cache.
        say: shows a message to the person.

    Raises:
        InputError, LabError: something cannot be used or reached; nothing has moved then.
    """
    refuse_simulated(spec.planner.name)
    if lab.conditions.camera == "recorded" and not operation.dry_run:
        raise InputError(
            "Recorded frames show what was there once, and an arm moves by what its camera sees now. Name a camera in "
            "the lab file, or add --dry-run."
        )
    system = build_system(spec.conditions, lab.workspace, planned_for(lab))
    blind = PERCEPTIONS.traits(system.pipeline.perception).needs_pictures
    if blind and not (wanted.pictures or wanted.mark):
        raise InputError(
            f"Perception '{spec.conditions.perception}' knows a target by pictures, not by words: give --reference "
            "pictures of it, or name a perception that reads words in the lab file (grounded-sam2, sam3)."
        )
    planner = make_spec_planner(spec.planner, vlm_cache, None)
    recorder = TrialRecorder(
        out,
        to_plain(spec, sources(spec.conditions)),
        overwrite=operation.overwrite,
        snapshots=operation.snapshots,
    )
    recorder.asked = spec.planner.vlm
    confirmation = Confirmation(operation.confirm, operation.ask)
    vlm = "" if spec.planner.vlm is None else spec.planner.vlm.text
    about = {"vlm": vlm or None, "participant": True, "lab": lab.name}

    def play() -> dict[str, Any]:
        with opened_lab(lab, confirmation) as robot, announced_compilation(say):
            careful, guard = guarded(system, robot.config)
            say(guard)
            within = LimitedMotionPlanner(careful.motion_planner, lab.robot, limits(lab))
            careful = replace(careful, motion_planner=within)
            config = EpisodeConfig(spec.conditions.max_picks, spec.seed)
            told: list[Listener] = [recorder, confirmation.listen, *listeners]
            episode = Episode(robot, careful, wanted, config, [lambda event: _tell(lab, event, told, say)])
            view_of(episode.rehearse(planner).context)
            known_by = "mark" if wanted.mark else "reference pictures"
            said = wanted.description or f"the object of the {known_by}"
            begun = Started(
                spec.problem_name, planner.name, spec.seed, said, config.max_picks, vlm=vlm, guard=guard
            )
            await_rest_pose(lab, lambda: robot.arm.qpos, operation.ask)
            if operation.dry_run:
                return _dry(lab, episode, planner, begun)
            resume = partial(_resume, lab, robot, operation.ask)
            result = run_episode(episode, planner, begun, resume)
            # The record keeps what a person took part in, but it is no result of the planner.
            status = "interrupted" if result.halts else "completed"
            return {"status": status, "halts": list(result.halts), **result_facts(result)}

    return recorded_trial(recorder, about, play, TorcError)


def _tell(lab: Lab, event: Event, listeners: Sequence[Listener], say: Callable[[str], None]) -> None:
    """Pass an event to the listeners. For a plan, also show where its motions lead, so that the person can confirm."""
    ways = ""
    if isinstance(event, Planned) and isinstance(plan := event.plan, PickPlan):
        event = replace(event, ways=tcp_ways(lab.robot, plan))
        ways = ways_text(event.ways, plan, lab.robot, limits(lab), lab.workspace.support_z_m)
    for listener in listeners:
        listener(event)
    if ways:
        say(ways)


def _dry(lab: Lab, episode: Episode, planner: TaskPlanner, begun: Started) -> dict[str, Any]:
    """Look, decide and plan once, without moving; return the result's entries."""
    episode.steps.tell(begun)
    plan: PickPlan | PlanFailure | PickOutcome | None = None
    if (look := episode.look()) is not None:
        plan = episode.plan(look, episode.decide(planner, look))
    match plan:
        case PickPlan():
            within = limits(lab)
            seconds = sum(m.duration_s * stretch_for(m, within, lab.robot) for m in plan.motions)
            text = f"{len(plan.motions)} motions, about {seconds:.0f} s at this speed"
        case PlanFailure():
            text = f"none: {plan.stage}: {plan.reason}"
        case PickOutcome():
            text = f"none: {plan.detail or plan.result.value}"
        case None:
            text = "none: no object is in sight"
    return {"status": "dry run", "plan": text}


def _resume(lab: Lab, robot: LabRobot, ask: Ask, error: Exception) -> None:
    """Let a person look after a stopped robot. Raises the error if the person does not want to continue."""
    arm = robot.arm
    assert isinstance(arm, SupervisedArm)
    while True:
        held = " The gripper keeps its grip." if robot.gripper.state.holding else ""
        if not ask(f"{error}{held} Look at the robot. Resume?"):
            raise error
        try:
            arm.resume()
            break
        except RobotStoppedError as again:
            error = again
    if robot.gripper.state.holding:
        if not ask("The gripper opens now: take what it holds. Open it?"):
            raise error
        robot.gripper.open(robot.gripper.max_width_m)
    await_rest_pose(lab, lambda: arm.qpos, ask)
