"""`torc human` and `torc view` as a user meets them."""

import json
import re
import signal
import subprocess
import sys
import urllib.request
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from tests.helpers.fake_trial import play_fake_trial
from tests.helpers.torc_command import run_torc
from torc.pipeline.frames import save_observation
from torc.pipeline.planners import make_planner
from torc.specs.trial import TrialSpec
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_observation


@contextmanager
def _served(*arguments):
    """A `torc` command that serves a page, in a process of its own; with the address that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", "torc.cli.main", *map(str, arguments), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        # Whoever runs the tests in the background may have told all children to ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    try:
        yield (
            process,
            next(found.group() for line in process.stdout if (found := re.search(r"http://\S+", line))),
        )
    finally:
        process.kill()
        process.communicate()


def _interrupted(process):
    """Ctrl-C: its exit code, and what it says in the end."""
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=60)
    return process.returncode, rest


@pytest.mark.long
@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_view_serves_until_ctrl_c_and_asks_for_a_token_where_others_reach_it(tmp_path, host):
    play_fake_trial(TrialSpec.of("boxes", "random"), tmp_path / "boxes", make_planner("random"))
    with _served("view", tmp_path, "--host", host) as (process, where):
        assert ("token=" in where) == (host != "127.0.0.1")
        here = re.sub(r"//[^:]+:", "//127.0.0.1:", where)
        with urllib.request.build_opener(urllib.request.HTTPCookieProcessor()).open(here, timeout=60) as page:
            assert b"<title>torc</title>" in page.read()
        code, rest = _interrupted(process)
    assert code == 0
    assert "Traceback" not in rest
    assert where.partition("token=")[2] not in rest or host == "127.0.0.1"


@pytest.mark.long
def test_a_camera_is_shown_live_until_ctrl_c(tmp_path):
    save_observation(
        tmp_path / "frames" / "frame_1", synthetic_observation((box(1, 0.62, 0.0, (0.06, 0.06, 0.1)),))
    )
    recorded = ("--camera", "recorded", "--camera.path", tmp_path / "frames")
    with _served("camera", "show", *recorded) as (process, where):
        numbers = []
        for _ in range(2):
            after = numbers[-1] if numbers else 0
            with urllib.request.urlopen(f"{where}api/camera.jpg?after={after}", timeout=60) as answer:
                numbers.append(int(answer.headers["X-Frame"]))
                assert json.loads(answer.headers["X-Facts"])["objects"] == "1"
                assert answer.read(3) == b"\xff\xd8\xff"
        code, rest = _interrupted(process)
    assert numbers[1] > numbers[0]
    assert code == 0
    assert "Traceback" not in rest


@pytest.mark.long
def test_human_says_what_is_left_after_ctrl_c(tmp_path):
    with _served("human", "structured-01", "structured-02", "--out", tmp_path) as (process, _):
        code, rest = _interrupted(process)
    assert code == 130
    assert "2 of 2 trials are left" in rest
    assert "Traceback" not in rest


def test_a_live_run_shows_each_pick_as_it_comes(tmp_path, monkeypatch, capsys):
    said, picks = [], []

    def play(command, spec, out):
        base, key = re.search(r"(http://\S+)#(\w+)", said[0]).groups()

        def look(event):
            with urllib.request.urlopen(f"{base}api/trials/{key}", timeout=60) as answer:
                picks.append(len(json.load(answer)["picks"]))

        play_fake_trial(spec, out, make_planner("dg-select"), [look])
        look(None)
        return 0

    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr("torc.cli.pages.tell", said.append)
    monkeypatch.setattr("torc.cli.run.threading", SimpleNamespace(Event=interrupted))
    monkeypatch.setattr("torc.cli.run.RunCommand._play", play)
    assert run_torc("run", "--live", "--out", tmp_path / "mine", capsys=capsys)[0] == 0
    assert (picks[0], picks[-1], picks) == (0, 2, sorted(picks))
