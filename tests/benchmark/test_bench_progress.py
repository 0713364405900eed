"""What is said while a benchmark runs."""

import io

from tests.helpers.fake_bench import fake_spec
from torc.benchmark.progress import Tally, shown
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


def test_elsewhere_than_on_a_terminal_there_are_plain_lines():
    stream = io.StringIO()
    with shown(2, stream) as show:
        show(Played(TRIALS[0], GOT))
        show(Played(TRIALS[1], ERRORED))
    lines = stream.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == ["[1/2]", "[2/2]"]
    assert "\x1b" not in stream.getvalue()
