"""Questions and answers between the thread that plays and the pages."""

import threading

import pytest

from torc.web.session import Choice, Phase, RefusedError, Session


def _asking(session, allowed, pick=2):
    session.publish(trial="t", phase=Phase.PREPARING)
    answers = []
    thread = threading.Thread(target=lambda: answers.append(session.ask_object(pick, allowed)), daemon=True)
    thread.start()
    while session.state.phase is not Phase.CHOOSING:
        pass
    return thread, answers


@pytest.mark.parametrize(
    ("allowed", "choice"), [((3, 5), Choice("t", 2, 5, note="it is in front")), ((), Choice("t", 2, None))]
)
def test_a_choice_reaches_who_asked(allowed, choice):
    session = Session()
    thread, answers = _asking(session, allowed)
    version = session.state.version
    session.choose(choice)
    thread.join(10)
    assert answers == [choice]
    assert (session.state.chosen, session.state.version) == (choice.object_id, version + 1)


@pytest.mark.parametrize(
    ("choice", "told"),
    [
        (Choice("t", 1, 5), "pick 2; it is pick 3"),
        (Choice("other", 2, 5), "another trial"),
        (Choice("t", 2, 4), "Object 4 cannot be grasped now; these can: 3, 5"),
        (Choice("t", 2, None), "Name an object; these can: 3, 5"),
    ],
)
def test_a_stale_or_impossible_choice_is_refused_and_the_question_stays(choice, told):
    session = Session()
    thread, answers = _asking(session, (3, 5))
    with pytest.raises(RefusedError, match=told):
        session.choose(choice)
    assert answers == []
    session.choose(Choice("t", 2, 3))
    thread.join(10)
    assert len(answers) == 1


def test_only_a_waiting_trial_can_be_started():
    session = Session()
    with pytest.raises(RefusedError, match="is being played"):
        session.start("a")
    started = []
    thread = threading.Thread(target=lambda: started.append(session.ask_start(("a", "b"), "")), daemon=True)
    thread.start()
    while session.state.phase is not Phase.READY:
        pass
    with pytest.raises(RefusedError, match="not in the queue"):
        session.start("c")
    session.start("b")
    thread.join(10)
    assert started == ["b"]
    assert session.state.trial == "b"
