"""Where a planned pick leads the hand: for the page, the log and the terminal, before anything moves."""

import json
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from test_lab_robot import plan
from test_supervisor import WIDE
from tests.helpers.fake_trial import play_fake_trial
from torc.episode.events import Planned
from torc.pipeline.planners import make_planner
from torc.records import PickPlan
from torc.robots.kinematics import tcp_pose
from torc.specs.trial import TrialSpec
from torc.trials.log import line_of
from torc.trials.recorded import read_trial
from torc.web.pick_page import pick_page
from torc_lab.checks import limits_of
from torc_lab.planning import MOTIONS, tcp_ways, ways_text
from torc_lab.retrieval import _tell


@pytest.fixture
def pick(robot):
    """A plan of the shipped robot: only its first joint moves."""
    drawn = plan(1)

    def moved(motion):
        path = np.tile(robot.arm.rest_qpos, (len(motion.times_s), 1))
        path[:, 0] += motion.qpos[:, 0]
        rates = np.zeros_like(path)
        rates[:, 0] = motion.qvel[:, 0]
        return replace(motion, qpos=path, qvel=rates)

    return replace(drawn, **{name: moved(getattr(drawn, name)) for name in MOTIONS})


def test_the_ways_are_where_the_fingertips_go(robot, pick):
    ways = tcp_ways(robot, pick)
    assert tuple(ways) == MOTIONS
    for name, places in ways.items():
        motion = getattr(pick, name)
        assert 2 <= len(places) <= 40
        for at, q in ((0, motion.qpos[0]), (-1, motion.qpos[-1])):
            np.testing.assert_allclose(places[at], tcp_pose(robot, q, 0.0)[:3, 3], atol=0.0006)
    for one, next_ in pairwise(MOTIONS):
        assert ways[one][-1] == ways[next_][0]


def test_they_are_told_in_words_at_the_speed_of_the_laboratory(robot, pick):
    ways = tcp_ways(robot, pick)
    quick, slow = (limits_of(robot, *WIDE, share, 0.0, 9.0) for share in (1.0, 0.01))
    lowest = 100 * (min(z for _, _, z in ways["free"]) - 1.05)
    text = ways_text(ways, pick, robot, quick, 1.05)
    assert f"free {_length(ways['free']):.2f} m in 0 s, lowest at {lowest:+.0f} cm" in text
    assert text.count(" m in ") == 5
    seconds = int(
        ways_text(ways, pick, robot, slow, 1.05).split("free ")[1].split(" m in ")[1].split(" s")[0]
    )
    fastest = np.abs(pick.free.qvel[:, 0]).max() / (0.01 * robot.arm.max_speed[0])
    assert seconds == pytest.approx(fastest * pick.free.duration_s, abs=1)


def _length(places):
    return np.linalg.norm(np.diff(np.array(places), axis=0), axis=1).sum()


def test_they_stand_in_the_log_and_on_the_page(robot, pick, tmp_path):
    """Of a real robot; a simulated trial's log is as it was."""
    seen = []
    spec = TrialSpec.of("boxes", "dg-select")
    trial = play_fake_trial(spec, tmp_path / "boxes", make_planner("dg-select"), [seen.append])
    planned = next(e for e in seen if isinstance(e, Planned) and isinstance(e.plan, PickPlan))
    assert "ways" not in line_of(planned).plain
    assert pick_page(read_trial(trial.directory), 0)["plan"]["ways"] == {}
    log = trial.directory / "events.jsonl"
    told = line_of(replace(planned, ways=tcp_ways(robot, pick))).plain
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    lines = [told if line["event"] == "planned" and line["pick"] == 0 else line for line in lines]
    log.write_text("".join(json.dumps(line) + "\n" for line in lines))
    page = pick_page(read_trial(trial.directory), 0)
    assert page["plan"]["ways"].keys() == set(MOTIONS)
    assert page["plan"]["ways"]["free"][0] == pytest.approx(tcp_ways(robot, pick)["free"][0])


def test_the_laboratory_adds_them_to_plans_alone(robot, workspace, pick, monkeypatch):
    monkeypatch.setattr("torc_lab.retrieval.limits", lambda lab: limits_of(robot, *WIDE, 1.0, 0.0))
    lab, seen, said = SimpleNamespace(robot=robot, workspace=workspace), [], []
    _tell(lab, Planned(0, None, pick, 0.1), [seen.append], said.append)
    _tell(lab, "another event", [seen.append], said.append)
    assert seen[0].ways == tcp_ways(robot, pick)
    assert seen[1] == "another event"
    assert len(said) == 1
