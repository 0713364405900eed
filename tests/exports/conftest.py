"""Recorded trials to export: real directories, made by fakes for robot and motions."""

import pytest

from tests.helpers.fake_episode import ScriptedPlanner
from tests.helpers.fake_trial import play_fake_trial
from torc.records import PickOutcome, PickResult
from torc.specs.trial import TrialSpec


class _Named(ScriptedPlanner):
    """A script under another planner's name."""

    def __init__(self, name, choices):
        super().__init__(choices)
        self.name = name


@pytest.fixture(scope="session")
def trials(tmp_path_factory):
    """The target 0 is behind box 1, box 2 stands beside them.

    oracle takes 1, 0; random takes 2, 1, 0; "lost" drops the target; "wild" names what is not there, and fails.
    Of mugs, dg-select takes 1 (which stays in sight), misses 2, and takes 1 and 0.
    """
    root = tmp_path_factory.mktemp("trials")

    def play(name, problem, choices, results=(), max_picks=5):
        spec = TrialSpec.of(problem, name, seed=4, max_picks=max_picks)
        play_fake_trial(spec, root / problem / name, _Named(name, choices), results=results)

    play("oracle", "boxes", [1, 0])
    play("random", "boxes", [2, 1, 0])
    play("lost", "boxes", [1], [PickOutcome(PickResult.STOPPED, 1, target_lost=True)])
    play("wild", "cans", [7, None, 2], [PickOutcome(PickResult.MISSED, 2)], max_picks=3)
    play("oracle", "cans", [1, 0])
    taken = PickOutcome(PickResult.REMOVED, 1, 1, True, True)
    play("dg-select", "mugs", [1, 2, 1, 0], [taken, PickOutcome(PickResult.MISSED, 2)])
    return root
