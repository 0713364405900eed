"""The learned picker's training."""

import numpy as np
import pytest

from tools.ideal import looks_of, retrieve
from tools.learned_picker import Choices, Collect, Train, choices_of, fit, gains_of, load_choices
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError
from torc.io.record_files import save_record
from torc.oracle.solve import MAX_PICKS
from torc.pipeline.building import build_system
from torc.problems.problem import load_problem
from torc.specs.conditions import Conditions
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.learned.features import FEATURE_NAMES
from torc.task_planning.learned.learned_planner import load_picker

N = len(FEATURE_NAMES)


def made_up(rng, looks: int) -> Choices:
    """Feature 4 alone tells the picks."""
    features = rng.normal(size=(6 * looks, N)).astype(np.float32)
    look = np.repeat(np.arange(looks), 6)
    picks = np.round(5 - 2 * features[:, 4]).astype(float)
    planners = np.tile([1, 0, 0, 0, 0, 0], looks)
    return Choices(features, picks, look, planners)


def test_what_tells_the_best_choice_gets_the_weight(rng):
    model = fit([made_up(rng, 80)])
    assert np.argmax(np.abs(model.weights)) == 4
    assert model.weights[4] > 0
    fresh = made_up(rng, 40)
    learned, best, random = np.array(gains_of(model, fresh))[:, 1:].mean(axis=0)
    assert best <= learned < random
    assert learned < best + 0.3


def test_gains_are_against_the_planner_that_goes_on(rng):
    model = fit([made_up(rng, 40)])
    features = np.zeros((3, N), np.float32)
    features[:, 4] = [0.0, 3.0, -3.0]
    c = Choices(features, np.array([4.0, 2.0, 9.0]), np.zeros(3, np.int64), np.array([1, 0, 0]))
    assert gains_of(model, c) == [(1.0, -2.0, -2.0, pytest.approx(1.0))]


def test_training_writes_a_model_that_loads(tmp_path, rng, capsys):
    for k in range(8):
        save_record(made_up(rng, 6), tmp_path / f"problem-{k}.npz")
    Train((tmp_path,), tmp_path / "picker.out").run()
    assert load_picker(tmp_path / "picker.out").notes == "8 problems, 48 looks"
    assert "48 looks" in capsys.readouterr().out


def test_what_cannot_be_trained_on_is_refused(tmp_path, rng):
    with pytest.raises(InputError, match="no choices"):
        load_choices([tmp_path])
    save_record(made_up(rng, 2), tmp_path / "one.npz")
    with pytest.raises(InputError, match="1 problems"):
        Train((tmp_path,), tmp_path / "out.npz").run()
    with pytest.raises(InputError, match="oracle"):
        Collect("validation", tmp_path, planner="oracle").run()


@pytest.mark.long
def test_each_choice_is_followed_to_its_end():
    system = build_system(Conditions())
    with open_sandbox(
        load_problem("validation-unstructured-01"), system, EpisodeConfig(MAX_PICKS, 0)
    ) as sandbox:
        look = looks_of(sandbox)
        found = choices_of(DgSelectPlanner(), look, most_looks=1)
        ids = look(()).report.graspable_ids
        assert len(found.picks) == len(ids)
        # The planner's own choice takes what its whole retrieval takes.
        assert found.picks[found.planners == 1] == retrieve(DgSelectPlanner(), look).picks
        assert (found.picks >= 1).all()
