"""Watching the robot: pictures come, and change nothing."""

import json
import threading

import pytest

from torc.episode.log_writing import without_seconds
from torc.episode.trial import Recording, run_trial
from torc.specs.trial import TrialSpec
from torc.web.expert import HumanPlanner, SessionListener
from torc.web.frames import FrameBoard, RobotCamera
from torc.web.session import Choice, Phase, Session

SPEC = TrialSpec.of("structured-04", "human", max_picks=1)


def _play(out, watch):
    """One pick by a person who takes the first graspable object, watched or not."""
    session, board, over = Session(), FrameBoard(), threading.Event()
    session.publish(trial="t")
    numbers = set()

    def sit_there():
        while not over.wait(0.01):
            state = session.state
            if watch:
                numbers.add(board.watch()[0])
            if state.phase is Phase.CHOOSING:
                session.choose(Choice("t", state.pick, state.allowed[0]))

    person = threading.Thread(target=sit_there, daemon=True)
    person.start()
    try:
        with RobotCamera(board) as camera:
            planner, tell = HumanPlanner(session), SessionListener(session)
            trial = run_trial(
                SPEC,
                out,
                planner=planner,
                listeners=[tell],
                recording=Recording(observers=(camera.observe,)),
                say=lambda _: None,
            )
    finally:
        over.set()
        person.join()
    assert trial.result["status"] == "completed"
    lines = (out / "events.jsonl").read_text().splitlines()
    return [without_seconds(json.loads(line)) for line in lines], numbers


@pytest.mark.slow
def test_a_real_pick_is_the_same_whether_watched_or_not(tmp_path):
    watched, numbers = _play(tmp_path / "a", watch=True)
    unwatched, none = _play(tmp_path / "b", watch=False)
    assert watched == unwatched
    assert len(numbers) > 10
    assert none == set()
