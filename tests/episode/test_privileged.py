"""The sandbox carries an episode on as the trial does, and leaves the trial alone."""

from typing import ClassVar

import numpy as np
import pytest

from tests.helpers.trial_logs import comparable_log
from torc.episode import steps
from torc.episode.events import Executed, Looked
from torc.episode.privileged import Privileged, open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, UnknownNameError
from torc.perception.checked_scenes import ask_camera
from torc.pipeline.building import build_system
from torc.pipeline.planners import make_planner, refuse_simulated
from torc.problems.problem import load_problem
from torc.specs.conditions import Conditions
from torc.specs.trial import TrialSpec
from torc.trials.log import line_of
from torc.trials.trial import run_trial

PROBLEM, SEED, PICKS = "structured-04", 1, 2


class Spy:
    """RANDOM that notes every moment of the trial, and tries something else in the sandbox first."""

    name = "random"
    moments: ClassVar[list] = []

    def attach(self, simulation):
        self.simulation = simulation

    def decide(self, context, rng):
        now, sandbox = self.simulation.now(), self.simulation.sandbox
        self.moments.append(now)
        sandbox.pick(now, sandbox.look(now), context.report.graspable_ids[-1])
        return make_planner("random").decide(context, rng)


@pytest.fixture(scope="module")
def sandbox():
    system = build_system(Conditions())
    with open_sandbox(load_problem(PROBLEM), system, EpisodeConfig(PICKS, SEED)) as sandbox:
        yield sandbox


def _digest(look):
    return line_of(Looked(0, look, 0.0, None)).plain["digest"]


def _trial(planner, directory, listeners=()):
    trial = run_trial(
        TrialSpec.of(PROBLEM, planner, SEED, max_picks=PICKS),
        directory,
        listeners=listeners,
        say=lambda text: None,
    )
    return comparable_log(trial.directory)


@pytest.mark.long
def test_a_trial_and_the_sandbox_go_the_same_way_and_do_not_disturb_each_other(sandbox, tmp_path):
    seen, done = [], []

    def listen(event):
        if isinstance(event, Looked):
            seen.append(_digest(event.look))
        if isinstance(event, Executed):
            done.append(event.outcome)

    Spy.moments.clear()
    spied = _trial(f"{__name__}:Spy", tmp_path / "spied", [listen])
    assert spied == _trial("random", tmp_path / "plain")

    moment = sandbox.begin()
    for digest, outcome, real in zip(seen, done, Spy.moments, strict=True):
        assert moment.same_as(real)
        look = sandbox.look(moment)
        assert _digest(look) == digest
        sandbox.look_without(moment, look.context.report.graspable_ids[:2])
        moment = sandbox.pick(moment, look, outcome.object_id)
        assert moment.episode.outcomes[-1] == outcome


def test_one_picture_is_looked_at_with_the_grasps_of_many_seeds(sandbox, monkeypatch):
    start, photos = sandbox.begin(), []
    alone = [_digest(sandbox.with_draws(seed).look(start)) for seed in (5, 3)]
    monkeypatch.setattr(steps, "ask_camera", lambda robot: photos.append(robot) or ask_camera(robot))
    looks = sandbox.looks_without(start, (), (5, 3, 5))
    first = next(looks)
    # What happens in between leaves the picture as it is.
    sandbox.look_without(start, first.context.report.graspable_ids[:2])
    assert [_digest(look) for look in (first, *looks)] == [*alone, alone[0]]
    assert len(set(alone)) == 2
    assert len(photos) == 2


def test_grasps_are_drawn_alike_whatever_is_gone(sandbox):
    start = sandbox.begin()
    taken = sandbox.look(start).context.report.graspable_ids[-1]
    (look,) = sandbox.looks_without(start, (taken,), (5,))
    later = sandbox.with_draws(5).look_without(start, (taken,))
    assert taken not in look.context.scene.ids
    seen, seen_later = (one.captures[0].observation for one in (look, later))
    assert np.array_equal(seen.depth_m, seen_later.depth_m)
    assert look.context.picks_left == later.context.picks_left + 1
    assert _digest(look) != _digest(later)


def test_privileged_planners_are_known_to_trials_alone():
    assert isinstance(make_planner("oracle"), Privileged)
    assert not isinstance(make_planner("random"), Privileged)
    with pytest.raises(UnknownNameError, match="Did you mean 'oracle'"):
        make_planner("oracel")
    with pytest.raises(UnknownNameError, match=r"oracle.*or your own as module:Class"):
        make_planner("x/mine.py")
    with pytest.raises(InputError, match="needs the simulation"):
        refuse_simulated("oracle")
