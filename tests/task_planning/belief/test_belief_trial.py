"""Whole trials with the planner `belief`, without physics."""

import json

import pytest

from tests.helpers.fake_trial import play_fake_trial
from torc.specs.trial import TrialSpec
from torc.task_planning.belief.belief_planner import BeliefPlanner
from torc.task_planning.belief.settings import BeliefConfig, GiveUpConfig
from torc.testing.synthetic import SyntheticBox
from torc.trials.recorded import read_trial

SPEC = TrialSpec.of("structured-01", "belief")


def test_it_finds_the_hidden_target_and_leaves_its_belief_beside_the_log(tmp_path):
    trial = play_fake_trial(SPEC, tmp_path / "trial", BeliefPlanner())
    assert (trial.result.retrieved, trial.result.picks) == (True, 2)
    recorded = read_trial(tmp_path / "trial")
    assert [p.decided.object_id for p in recorded.picks] == [1, 0]
    assert recorded.belief(0).startswith(b"\x89PNG")
    evidence = recorded.picks[0].decided.evidence
    assert evidence.belief.order[0] == 1
    assert len(json.dumps(evidence.to_plain())) < 20_000


@pytest.mark.parametrize("height_m", [0.012, 0.20])
def test_a_target_that_is_not_there_is_given_up_once_all_has_been_seen(tmp_path, height_m):
    """Flat things hide hardly anything: it gives up at once. Behind a tall one there may be something."""
    shapes = (
        SyntheticBox(1, (0.58, -0.12, 1.05 + height_m / 2), (0.05, 0.14, height_m)),
        SyntheticBox(2, (0.62, -0.40, 1.056), (0.04, 0.04, 0.012)),
    )
    planner = BeliefPlanner(BeliefConfig(give_up=GiveUpConfig(below=0.25)))
    trial = play_fake_trial(SPEC, tmp_path / "trial", planner, shapes=shapes)
    assert not trial.result.retrieved
    assert trial.result.end == "gave up"
    assert trial.result.picks == (0 if height_m < 0.1 else 1)
