"""Signals that ask a program to end act as Ctrl-C does, whoever sends them."""

import os
import signal
import subprocess
import sys

import pytest

from torc.interrupts import ended_like_ctrl_c, interrupts_held

SLEEPER = """
import sys, time
from torc.interrupts import ended_like_ctrl_c
try:
    with ended_like_ctrl_c():
        print("ready", flush=True)
        time.sleep(60)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    open(sys.argv[1], "w").write("saved")
    sys.exit(130)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("sent", "ignored", "saved"),
    [
        (signal.SIGTERM, (), True),
        (signal.SIGHUP, (), True),
        (signal.SIGINT, (signal.SIGINT,), True),  # in the background of a script
        (signal.SIGHUP, (signal.SIGHUP,), False),  # nohup
    ],
)
def test_a_signal_ends_a_program_that_saves_its_work(tmp_path, sent, ignored, saved):
    out = tmp_path / "out"

    def ignore():
        """Whatever this process was started with, maybe by nohup."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN if number in ignored else signal.SIG_DFL)

    process = subprocess.Popen(
        [sys.executable, "-c", SLEEPER, str(out)], stdout=subprocess.PIPE, text=True, preexec_fn=ignore
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(sent)
    if sent == signal.SIGHUP and not saved:
        process.terminate()
    assert process.wait(30) == 130
    assert out.read_text() == "saved"
    # Once the terminal is gone nothing may be printed to it.
    printed = process.stdout.read()
    assert printed == ("" if sent == signal.SIGHUP and saved else "interrupted\n")
    process.stdout.close()


def test_what_must_not_be_interrupted_is_done_first():
    steps = []

    def work():
        with interrupts_held():
            os.kill(os.getpid(), signal.SIGTERM)
            os.kill(os.getpid(), signal.SIGINT)
            steps.append("done")
        steps.append("never")

    with pytest.raises(KeyboardInterrupt), ended_like_ctrl_c():
        work()
    assert steps == ["done"]


def test_the_handlers_from_before_come_back():
    before = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    with ended_like_ctrl_c(), interrupts_held():
        pass
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == before
