"""The three verbs: an episode by hand, a trial, a comparison."""

import pytest

import torc
from torc.errors import InputError, UnknownNameError
from torc.records import Decision

PROBLEM = "validation-structured-02"


class Nearest:
    name = "nearest"

    def decide(self, context, rng):
        return Decision(min(context.graspable_ids, default=None), "the lowest number")


def quiet(text):
    pass


@pytest.mark.long
def test_an_episode_by_hand_goes_as_the_trial_of_a_planner_with_the_same_picks():
    trial = torc.play(PROBLEM, Nearest, seed=3, max_picks=2, say=quiet)
    assert trial.directory is None
    assert trial.result.completed
    with torc.Episode(PROBLEM, seed=3, max_picks=2, say=quiet) as episode:
        while not episode.done:
            context = episode.look()
            assert context is episode.look()
            assert all(context.p(k) > 0 for k in context.graspable_ids)
            outcome = episode.pick(min(context.graspable_ids, default=None))
            assert outcome is episode.outcomes[-1]
        with pytest.raises(InputError, match="The episode is over"):
            episode.pick(1)
    assert (episode.retrieved, episode.end) == (trial.result.retrieved, trial.result.end)
    assert [line.event for line in episode.log] == [line.event for line in trial.log]
    seen, by_hand = (
        [line.digest for line in log if line.event in ("looked", "planned")]
        for log in (trial.log, episode.log)
    )
    assert seen == by_hand


@pytest.mark.long
def test_planners_by_class_and_by_name_are_compared_on_equal_terms(tmp_path):
    table = torc.bench([PROBLEM], [Nearest, "random"], repeats=2, max_picks=1, out=tmp_path / "bench")
    assert [row.cell for row in table.rows] == [
        (name, PROBLEM, seed) for name in ("nearest", "random") for seed in (0, 1)
    ]
    assert all(row.completed and row.picks == 1 for row in table.rows)
    again = torc.bench([PROBLEM], [Nearest, "random"], repeats=2, max_picks=1, out=tmp_path / "bench")
    assert again.rows == table.rows


def test_what_cannot_be_used_is_said_before_anything_is_played(tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean 'perception'"):
        torc.play(PROBLEM, perceptoin="embedded")
    with pytest.raises(UnknownNameError, match="planner"):
        torc.play(PROBLEM, "dg-selekt", out=tmp_path / "trial")
    with pytest.raises(InputError, match="is not a task planner"):
        torc.play(PROBLEM, 3)
    with pytest.raises(InputError, match="MyPlanner\\(power=2\\)"):
        torc.play(PROBLEM, settings={"planner.power": 2})
    with pytest.raises(InputError, match="need a directory"):
        torc.play(PROBLEM, video=True)
    with pytest.raises(UnknownNameError, match="problem"):
        torc.Episode("structured-99999")
    with pytest.raises(InputError, match="several workers"):
        torc.bench(PROBLEM, [Nearest()], workers=2)
    assert not list(tmp_path.iterdir())
