"""`torc retrieve` over real wires: the simulator behind them, and what goes wrong in laboratories."""

import json
import re
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from test_lab_file import TEXT
from torc.episode.events import Planned
from torc.episode.simulated import pictured_target
from torc.errors import InputError
from torc.perception.protocol import Wanted
from torc.problems.problem import load_problem
from torc.specs.trial import PlannerSpec
from torc.trials.recorded import read_events
from torc_lab.checking import check_lab
from torc_lab.lab_file import example_labs
from torc_lab.retrieval import Operation, lab_spec, retrieve
from torc_lab.twin.rehearsal import FAULTS, recover

pytest.importorskip("websockets", reason="websockets is not installed")
pytest.importorskip("pymodbus", reason="pymodbus is not installed")
PROBLEM = "validation-structured-02"
# The UR's twin is left out where a whole trial is played: it has to say something every .3 s, and twins share the
# interpreter with torc here. `torc lab twin` has a process of its own.


def wanted():
    return pictured_target(load_problem(PROBLEM))


def played(lab, out, ask=lambda question: False, listeners=(), **options):
    operation = Operation(options.pop("confirm", "never"), ask, **options)
    spec = lab_spec(lab, PlannerSpec("dg-select"))
    return retrieve(lab, spec, wanted(), out, operation, listeners=listeners, say=lambda text: None)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in example_labs() if name != "ur5e-rtde"])
def test_picks_over_the_wires_bring_what_they_say(name, rehearsed, patient, tmp_path):
    with rehearsed(name) as (there, lab):
        trial = played(lab, tmp_path / "trial")
        truth = there.world.truth()
    result = trial.result
    assert result.status == "completed", result
    assert 1 <= result.grasps_delivered <= len(truth.in_bin)  # two may come up at a time
    assert set(result.outcomes) <= {"removed", "retrieved", "missed", "slipped"}
    if result.retrieved:  # it may have brought the target without knowing it
        assert truth.retrieved
    events = [line.event for line in read_events(trial.directory / "events.jsonl")]
    assert events[0] == "started"
    assert events[-1] == "ended"


@pytest.mark.long
def test_a_dry_run_moves_nothing(rehearsed, patient, tmp_path):
    with rehearsed() as (there, lab):
        before, sent = there.world.qpos, len(there.arm.heard)
        trial = played(lab, tmp_path / "trial", dry_run=True)
        np.testing.assert_allclose(there.world.qpos, before, atol=1e-3)
        assert len(there.arm.heard) == sent
    assert trial.result.status == "dry run"
    assert trial.result.plain["plan"].startswith("5 motions")
    lines = {line.event: line for line in read_events(trial.directory / "events.jsonl")}
    assert "feels no contact" in lines["started"].guard
    assert len(lines["planned"].ways["approach"]) >= 2
    assert (trial.directory / "picks" / "00_seen.png").exists()


@pytest.mark.long
def test_checking_finds_what_is_wrong_and_moves_only_if_asked(rehearsed):
    with rehearsed() as (there, lab):
        sent = len(there.arm.heard)
        still = list(check_lab(lab))
        assert all(f.good for f in still)
        assert len(there.arm.heard) == sent
        arm, texts = lab.robot.arm, " ".join(f.text for f in still)
        for name, lower, upper in zip(arm.joint_names, arm.lower, arm.upper, strict=True):
            assert re.search(rf"{name} -?\d\.\d+ \({lower:.3f} to {upper:.3f}\)", texts)
        assert "max_width_m is 0.085" in texts
        moved = list(check_lab(lab, lambda question: True))
        assert all(f.good for f in moved)
        assert sum("turned as commanded, and back" in f.text for f in moved) == 7
        there.gripper.fault = 0x0E
        there.arm.halt(e_stopped=1)
        bad = {f.device: f.text for f in check_lab(lab) if not f.good}
        assert bad["arm"] == "e-stop"
        assert "current is too high" in bad["gripper"]


class Fault:
    """Lets something go wrong so long after the first plan, once; as soon as it can."""

    def __init__(self, there, name, after_s):
        self.there, self.name, self.after_s = there, name, after_s
        self.happened, self.ended, self._timer = False, False, None

    def __call__(self, event):
        if isinstance(event, Planned) and self._timer is None:
            self._timer = threading.Timer(self.after_s, self._happen)
            self._timer.start()

    def _happen(self):
        while not (self.happened or self.ended):
            # False: the arm rests, and nothing can stop halfway.
            self.happened = FAULTS[self.name][1](self.there) is not False
            time.sleep(0 if self.happened else 0.02)


def check_fault(rehearsed, tmp_path, wire, name, after_s):
    """A fault within a pick: the arm stops, nothing more is sent, no pick failed, and the log tells it."""
    with rehearsed(wire) as (there, lab):
        fault = Fault(there, name, after_s)
        trial = played(lab, tmp_path / "trial", listeners=[fault])
        fault.ended = True
        sent, stopped_at = len(there.arm.heard), there.world.qpos
        time.sleep(0.4)
        assert len(there.arm.heard) == sent
        if name not in ("cut", "nudge"):  # a controller without a connection goes on to the end of its motion
            np.testing.assert_allclose(there.world.qpos, stopped_at, atol=0.02)
    assert trial.result.status in ("errored", "interrupted"), trial.result
    assert fault.happened, f"It ended so without a fault: {trial.result}."
    assert "outcomes" not in trial.result.plain
    lines = read_events(trial.directory / "events.jsonl")
    told = [line.reason for line in lines if line.event == "halted"]
    assert told or trial.result.error


@pytest.mark.long
@pytest.mark.parametrize("name", ["e-stop", "silence", "pretend-done", "gripper-fault"])
def test_a_fault_within_a_pick_ends_the_trial_and_no_pick_failed(name, rehearsed, patient, tmp_path):
    check_fault(rehearsed, tmp_path, "sda10f-simple-message", name, 1.2)


@pytest.mark.slow
@pytest.mark.parametrize("wire", ["sda10f-ros1", "sda10f-simple-message"])
@pytest.mark.parametrize("name", [n for n in FAULTS if n not in ("nudge", "freeze-camera")])
def test_faults_at_random_moments(wire, name, rehearsed, tmp_path):
    rng = np.random.default_rng(len(name))
    for k, after_s in enumerate(rng.uniform(0.1, 5.0, 20)):
        check_fault(rehearsed, tmp_path / f"{k}", wire, name, float(after_s))


@pytest.mark.long
def test_somebody_resumes_after_an_e_stop_and_the_episode_goes_on_unscored(
    rehearsed, patient, tmp_path, robot
):
    questions = []
    with rehearsed() as (there, lab):

        def ask(question):
            questions.append(question)
            recover(there)
            if "rest pose" in question:  # by hand
                here = there.world.qpos
                for share in np.linspace(0, 1, 100):
                    there.world.goal(here + share * (robot.arm.rest_qpos - here))
                    time.sleep(0.02)
                time.sleep(0.3)
            return True

        trial = played(lab, tmp_path / "trial", ask, [Fault(there, "e-stop", 1.0)])
        truth = there.world.truth()
    assert len(truth.in_bin) >= 1
    assert trial.result.status == "interrupted", trial.result
    assert trial.result.picks >= 1
    assert len(trial.result.plain["halts"]) == 1
    assert "e-stop" in trial.result.plain["halts"][0]
    assert any("Resume?" in q for q in questions)


@pytest.mark.long
def test_a_motion_that_is_not_confirmed_is_not_sent(rehearsed, patient, tmp_path):
    asked = []

    def no(question):
        asked.append(question)
        return False

    with rehearsed() as (there, lab):
        sent = len(there.arm.heard)
        trial = played(lab, tmp_path / "trial", no, confirm="motion")
        assert len(there.arm.heard) == sent
    assert "Go?" in asked[0]
    assert trial.result.status == "errored"
    assert "not confirmed" in trial.result.error


def test_what_cannot_be_reached_or_known_leaves_nothing_behind(tmp_path):
    from torc_lab.lab_file import load_lab

    path = tmp_path / "lab.yaml"
    path.write_text(TEXT.replace("192.168.1.10:9090", "127.0.0.1:9"), encoding="utf-8")
    lab, spec = load_lab(path), None
    spec = lab_spec(lab, PlannerSpec("dg-select"))
    with pytest.raises(InputError, match="--reference"):
        retrieve(lab, spec, Wanted("a mug"), tmp_path / "runs" / "trial", Operation("never"))
    lab = replace(lab, conditions=replace(lab.conditions, camera="recorded"))
    with pytest.raises(InputError, match="--dry-run"):
        retrieve(lab, spec, wanted(), tmp_path / "runs" / "trial", Operation("never"))
    lab = load_lab(path)
    bad = [f for f in check_lab(lab) if not f.good]
    assert {f.device for f in bad} == {"arm", "gripper", "camera"}
    assert json.dumps([f.text for f in bad]).count("cannot be reached") >= 1
    assert not (tmp_path / "runs").exists()
