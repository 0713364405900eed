"""A laboratory of twins."""

from contextlib import contextmanager
from functools import partial

import pytest

from torc.problems.problem import load_problem
from torc_lab import supervisor
from torc_lab.devices import connect_arm, connect_gripper
from torc_lab.lab_file import example_labs, load_lab
from torc_lab.supervisor import SupervisorConfig
from torc_lab.twin.rehearsal import rehearsal, write_lab


@pytest.fixture(autouse=True)
def publishers_connect_at_once(monkeypatch):
    """The twin hears every topic from the start; a real ROS 1 takes half a second."""
    monkeypatch.setattr("torc_lab.ros.arm._CONNECTS_S", 0.01)


@pytest.fixture
def patient(monkeypatch):
    """The supervisor, the gripper and its twin wait longer: twins share the interpreter with torc here, and a busy
    machine's pauses are not the arm's or the gripper's silence.
    """
    monkeypatch.setattr(supervisor, "SupervisorConfig", partial(SupervisorConfig, stale_s=3.0, lag_s=3.0))
    monkeypatch.setattr("torc_lab.robotiq.gripper._ECHO_S", 5.0)
    monkeypatch.setattr("torc_lab.twin.robotiq._SILENCE_S", 10.0)


@pytest.fixture
def rehearsed(tmp_path):
    """Opens a rehearsal of an example, its devices powered and ready: the twins, and the lab that leads to them."""

    @contextmanager
    def opened(name="sda10f-simple-message", problem="validation-structured-02", speed=1.0, max_picks=4):
        own, twin = tmp_path / "lab.yaml", tmp_path / "twin.yaml"
        text = example_labs()[name].replace("  speed: 0.1 ", f"  tcp_speed_m_s: 5\n  speed: {speed} ")
        text = text.replace("pipeline:\n", f"pipeline:\n  max_picks: {max_picks}\n")
        # Kernels that are compiled meanwhile hold the interpreter for seconds, and the twins with it.
        for device in ("arm", "gripper"):
            text = text.replace(f"\n{device}:\n", f"\n{device}:\n  timeout_s: 10\n")
        own.write_text(text, encoding="utf-8")
        with rehearsal(load_lab(own), load_problem(problem)) as there:
            write_lab(there.text, twin)
            lab = load_lab(twin)
            gripper, arm = connect_gripper(lab), connect_arm(lab)
            gripper.activate()
            if hasattr(arm, "enable"):
                arm.enable()
            gripper.disconnect()
            arm.close()
            yield there, lab

    return opened
