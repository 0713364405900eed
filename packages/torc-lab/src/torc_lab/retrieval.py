"""One trial on a real robot: the same loop, log and pictures as in simulation, with a person beside it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from torc import InputError, PickOutcome, PlannerSpec, TorcError, Trial, TrialSpec, Wanted
from torc.episode.events import Event, Listener, Planned, Started
from torc.episode.log import result_facts
from torc.episode.loop import Episode, run_episode
from torc.episode.pick_view import view_of
from torc.episode.recorder import TrialRecorder
from torc.episode.steps import EpisodeConfig
from torc.episode.trial import recorded_trial
from torc.pipeline.building import System, build_system, sources
from torc.pipeline.planners import make_spec_planner, refuse_simulated
from torc.pipeline.warm_up import announced_compilation
from torc.records import PickPlan, PlanFailure
from torc.registry.kinds import PERCEPTIONS
from torc.specs.spec_files import to_plain
from torc.task_planning.protocol import TaskPlanner
from torc.vlm.cache import CacheConfig
from torc_lab.checks import stretch_for
from torc_lab.devices import is_at_rest_pose, limits, opened_lab, planned_for
from torc_lab.guarding import guarded
from torc_lab.lab_file import Lab
from torc_lab.person import Ask, Confirmation, Confirming, ask_in_terminal
from torc_lab.planning import LimitedMotionPlanner
from torc_lab.protocols import LabError, RobotStoppedError
from torc_lab.robot import LabRobot
from torc_lab.supervisor import SupervisedArm
from torc_lab.ways import tcp_ways, ways_text


@dataclass(frozen=True)
class Operation:
    """How a person takes part.

    Attributes:
        confirm: before which motions `ask` is asked.
        ask: asks yes or no.
        dry_run: look, decide and plan once; nothing moves.
        overwrite: a directory of results that exists is replaced.
        snapshots: each one is also saved as a record.
    """

    confirm: Confirming = "motion"
    ask: Ask = ask_in_terminal
    dry_run: bool = False
    overwrite: bool = False
    snapshots: bool = False


def lab_spec(lab: Lab, planner: PlannerSpec, seed: int = 0) -> TrialSpec:
    """The spec of a trial in a laboratory, whose name stands for the problem's."""
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
    """Plays one trial on the robot of a lab file, and writes its directory.

    A device that is lost makes the trial "errored", never a failed pick. A robot that was stopped halts the pick, which
    then has no result; if a person resumes, the episode goes on, and the trial is told, but not scored
    ("interrupted"). Ctrl-C stops the arm, waits until it rests, and ends the trial. Raises InputError and LabError,
    before anything moves, if something cannot be used or reached.
    """
    refuse_simulated(spec.planner.name)
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
    about = {
        "vlm": None if spec.planner.vlm is None else spec.planner.vlm.text,
        "participant": True,
        "lab": lab.name,
    }

    def play() -> dict[str, Any]:
        with opened_lab(lab, confirmation) as robot, announced_compilation(say):
            careful, guard = guarded(system, robot.config)
            say(guard)
            trial = _LabTrial(lab, careful, guard, robot, planner, wanted, operation, say)
            return trial.play(spec, [recorder, confirmation.listen, *listeners])

    return recorded_trial(recorder, about, play, TorcError)


class _LabTrial:
    """The episode, and what is asked of the person around it."""

    def __init__(
        self,
        lab: Lab,
        system: System,
        guard: str,
        robot: LabRobot,
        planner: TaskPlanner,
        wanted: Wanted,
        operation: Operation,
        say: Callable[[str], None],
    ) -> None:
        self.lab, self.robot, self.planner = lab, robot, planner
        self.wanted, self.operation, self.say = wanted, operation, say
        within = LimitedMotionPlanner(system.motion_planner, lab.robot, limits(lab))
        self.system, self.guard = replace(system, motion_planner=within), guard

    def play(self, spec: TrialSpec, listeners: Sequence[Listener]) -> dict[str, Any]:
        """The facts of the result."""

        def tell(event: Event) -> None:
            event = self._with_ways(event)
            for listener in listeners:
                listener(event)
            if isinstance(event, Planned) and isinstance(event.plan, PickPlan):
                z = self.lab.workspace.support_z_m
                self.say(ways_text(event.ways, event.plan, self.lab.robot, limits(self.lab), z))

        config = EpisodeConfig(spec.conditions.max_picks, spec.seed)
        episode = Episode(self.robot, self.system, self.wanted, config, [tell])
        view_of(episode.rehearse(self.planner).context)
        vlm = "" if spec.planner.vlm is None else spec.planner.vlm.text
        said = (
            self.wanted.description
            or f"the object of the {'mark' if self.wanted.mark else 'reference pictures'}"
        )
        begun = Started(spec.problem_name, self.planner.name, spec.seed, said, config.max_picks, vlm=vlm)
        begun = replace(begun, guard=self.guard)
        self._await_rest_pose()
        if self.operation.dry_run:
            return self._dry(episode, begun)
        result = run_episode(episode, self.planner, begun, self._resume)
        # The record keeps what a person took part in, but it is no result of the planner.
        return {
            "status": "interrupted" if result.halts else "completed",
            "halts": list(result.halts),
            **result_facts(result),
        }

    def _with_ways(self, event: Event) -> Event:
        """Whoever is asked before the motions sees where they lead."""
        if isinstance(event, Planned) and isinstance(event.plan, PickPlan):
            return replace(event, ways=tcp_ways(self.lab.robot, event.plan))
        return event

    def _dry(self, episode: Episode, begun: Started) -> dict[str, Any]:
        """Look, decide and plan once; nothing moves."""
        episode.steps.tell(begun)
        plan: PickPlan | PlanFailure | PickOutcome | None = None
        if (look := episode.look()) is not None:
            plan = episode.plan(look, episode.decide(self.planner, look))
        match plan:
            case PickPlan():
                within, robot = limits(self.lab), self.lab.robot
                seconds = sum(m.duration_s * stretch_for(m, within, robot) for m in plan.motions)
                text = f"{len(plan.motions)} motions, about {seconds:.0f} s at this speed"
            case PlanFailure():
                text = f"none: {plan.stage}: {plan.reason}"
            case PickOutcome():
                text = f"none: {plan.detail or plan.result.value}"
            case None:
                text = "none: no object is in sight"
        return {"status": "dry run", "plan": text}

    def _resume(self, error: Exception) -> None:
        """Lets a person look after a robot that was stopped. Raises the error if he does not want to go on."""
        arm = self.robot.arm
        assert isinstance(arm, SupervisedArm)
        while True:
            held = " The gripper keeps its grip." if self.robot.gripper.state.holding else ""
            if not self.operation.ask(f"{error}{held} Look at the robot. Resume?"):
                raise error
            try:
                arm.resume()
                break
            except RobotStoppedError as again:
                error = again
        if self.robot.gripper.state.holding:
            if not self.operation.ask("The gripper opens now: take what it holds. Open it?"):
                raise error
            self.robot.gripper.open(self.robot.gripper.max_width_m)
        self._await_rest_pose()

    def _await_rest_pose(self) -> None:
        """Waits until the arm is where it does not hide the table. Raises LabError if nobody brings it there."""
        while not is_at_rest_pose(self.lab, self.robot.arm.qpos):
            here, rest = (
                ", ".join(f"{v:.2f}" for v in q) for q in (self.robot.arm.qpos, self.lab.robot.arm.rest_qpos)
            )
            question = (
                f"The arm is at ({here}) rad, not at its rest pose ({rest}). Bring it there by hand. Ready?"
            )
            if not self.operation.ask(question):
                raise LabError("The arm is not at its rest pose: it would hide the table from the camera.")
