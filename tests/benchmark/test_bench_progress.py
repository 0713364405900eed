"""What is said while a benchmark runs."""

import io

from tests.helpers.fake_bench import fake_spec
from torc.benchmark.progress import Tally, line_of, shown
from torc.benchmark.runner import Played

TRIALS = fake_spec().trials
GOT = {"status": "completed", "retrieved": True, "end": "retrieved", "picks": 3, "drops": 1}
LOST = {"status": "completed", "retrieved": False, "end": "target lost", "picks": 9, "drops": 0}
ERRORED = {"status": "errored", "cause": "hung", "error": "It was ended after 5 s [bold]."}


def test_rates_and_what_is_left():
    now = [100.0]
    tally = Tally(10, lambda: now[0])
    assert tally.pace == ""
    for i, result in enumerate((GOT, LOST, ERRORED, GOT)):
        now[0] += 15.0
        tally.add(Played(TRIALS[2 * i], result))
    assert tally.pace == "4 a minute, 2 min left"
    assert tally.so_far == "retrieved: random 2/3; errored: 1"


def test_a_line_per_trial():
    assert line_of(Played(TRIALS[0], GOT)) == "random on structured-01, seed 0: retrieved, 3 picks, 1 dropped"
    assert "not retrieved (target lost), 9 picks" in line_of(Played(TRIALS[0], LOST))
    assert line_of(Played(TRIALS[0], ERRORED)).endswith("ERRORED: It was ended after 5 s [bold].")


def test_elsewhere_than_on_a_terminal_there_are_plain_lines():
    stream = io.StringIO()
    with shown(2, stream) as show:
        show(Played(TRIALS[0], GOT))
        show(Played(TRIALS[1], ERRORED))
    lines = stream.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == ["[1/2]", "[2/2]"]
    assert "\x1b" not in stream.getvalue()


def test_on_a_terminal_there_is_a_live_line_and_errors_stay(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm-256color")
    stream = io.StringIO()
    with shown(2, stream) as show:
        show(Played(TRIALS[0], GOT))
        show(Played(TRIALS[1], ERRORED))
    text = stream.getvalue()
    assert "It was ended after 5 s [bold]." in text
    assert "2/2" in text
