"""The oracle foresees what happens, follows what it foresaw, and thinks again where it was wrong."""

import json

import numpy as np
import pytest

from torc.episode.events import Decided, Executed
from torc.episode.privileged import SimulatedState
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError
from torc.occlusion.volume import empty_volume
from torc.oracle.oracle_planner import OraclePlanner
from torc.oracle.search import Found
from torc.oracle.solve import solve_problem
from torc.oracle.tree import Cost, Path, Spent
from torc.pipeline.building import build_system
from torc.pipeline.state import EpisodeState
from torc.problems.problem import load_problem
from torc.records import PickOutcome, PickResult
from torc.sim.robot import RobotState
from torc.specs.conditions import Conditions
from torc.specs.trial import TrialSpec
from torc.testing import contexts
from torc.trials.trial import run_trial
from torc.workspace.workspace_files import load_workspace

PROBLEM = load_problem("structured-04")
NAMES = [placement.name for placement in PROBLEM.ordered()]
REMOVED, RETRIEVED = (
    PickOutcome(result, 3, 3, True, True) for result in (PickResult.REMOVED, PickResult.RETRIEVED)
)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "seed", "picks"),
    [("structured-04", 3, 2), pytest.param("structured-05", 0, 3, marks=pytest.mark.slow)],
)
def test_a_trial_goes_as_the_oracle_foresees(name, seed, picks, tmp_path):
    problem = load_problem(name)
    names = [placement.name for placement in problem.ordered()]
    answer = solve_problem(problem, build_system(Conditions()), seed)
    assert answer.picks == picks
    assert answer.solved
    assert answer.proved
    decided, outcomes, said = [], [], []

    def listen(event):
        if isinstance(event, Decided):
            decided.append(event.decision)
        if isinstance(event, Executed):
            outcomes.append(event.outcome)

    trial = run_trial(
        TrialSpec.of(name, "oracle", seed), tmp_path / "trial", listeners=[listen], say=said.append
    )
    assert trial.result.retrieved
    assert (trial.result.picks, trial.result.drops) == (answer.picks, answer.drops)
    assert outcomes == [pick.outcome for pick in answer.foreseen]
    assert [names[d.object_id] for d in decided] == list(answer.order)
    # A trial does without the proof, so that it may have tried out less.
    effort = {"bound", "proved", "likely", "lower_bound", "rough_bound", "picks_tried", "looks"}
    foreseen = {key: value for key, value in answer.to_dict().items() if key not in effort}
    for decision in decided:
        assert foreseen.items() <= decision.evidence.notes["foreseen"].items()
        assert decision.evidence.notes["bound"] == trial.result.bound == "proved"
    assert sum("trying out" in text for text in said) == 1


@pytest.mark.parametrize("budget", [0, -1, float("nan"), float("inf")])
def test_a_budget_that_is_none_is_refused(budget):
    with pytest.raises(InputError, match="number of simulated picks"):
        OraclePlanner(budget)


def moment(world: float, *outcomes: PickOutcome) -> SimulatedState:
    """A moment whose world is one number."""
    robot = RobotState(np.array([float(world)]), (False, 1.0), (0, None))
    return SimulatedState(robot, EpisodeState(empty_volume(load_workspace().grid), (), outcomes))


class Staged:
    """A simulation whose present is told, and searches whose results are told."""

    problem, config, sandbox = PROBLEM, EpisodeConfig(max_picks=9, seed=0), None

    def __init__(self, monkeypatch, *results):
        self.searches, results = [], iter(results)

        def best_order(sandbox, now, max_picks, budget, say, *, likely_suffices):
            assert likely_suffices
            self.searches.append((now, max_picks))
            return next(results)

        monkeypatch.setattr("torc.oracle.oracle_planner.best_order", best_order)
        self.planner = OraclePlanner()
        self.planner.attach(self)

    def say(self, text):
        pass

    def now(self):
        return self.present

    def decide_at(self, present):
        self.present = present
        decision = self.planner.decide(contexts.open_context(), np.random.default_rng(0))
        json.dumps(decision.evidence.to_plain(), allow_nan=False)
        return decision


def found(*choices, states, solved=True, bound=2, likely=False):
    path = Path(choices, states, ("",) * len(states), Cost(len(choices), 0))
    nothing = Path((), states[:1], ("",), Cost(0, 0))
    best, outlook = (path, nothing) if solved else (None, path)
    return Found(best, Cost(bound, 0), bound, outlook, Spent(3, 4), likely=likely)


def test_it_follows_what_it_foresaw_and_searches_once(monkeypatch):
    start, middle, end = moment(1), moment(2, REMOVED), moment(3, REMOVED, RETRIEVED)
    stage = Staged(monkeypatch, found(3, 0, states=(start, middle, end)))
    first, second = stage.decide_at(moment(1)), stage.decide_at(moment(2, REMOVED))
    assert (first.object_id, second.object_id) == (3, 0)
    assert len(stage.searches) == 1
    assert f"then {NAMES[0]}: 2 picks, 0 drops; no order does with less" in first.reason
    assert "pick 2 of the 2 foreseen" in second.reason


@pytest.mark.parametrize("real", [moment(2.5, REMOVED), moment(2, RETRIEVED)], ids=["world", "outcome"])
def test_where_it_was_wrong_it_searches_again_with_the_picks_that_are_left(monkeypatch, real):
    start, middle, end = moment(1), moment(2, REMOVED), moment(3, REMOVED, RETRIEVED)
    again = found(5, 0, states=(real, end, end))
    stage = Staged(monkeypatch, found(3, 0, states=(start, middle, end)), again)
    stage.decide_at(start)
    assert stage.decide_at(real).object_id == 5
    assert [picks for _, picks in stage.searches] == [9, 8]
    assert stage.searches[1][0] is real


def test_where_no_order_is_found_it_follows_the_beginning_and_then_searches_again(monkeypatch):
    start, middle, end = moment(1), moment(2, REMOVED), moment(3, REMOVED, RETRIEVED)
    beginning = found(3, states=(start, middle), solved=False)
    stage = Staged(monkeypatch, beginning, found(0, states=(middle, end)))
    first = stage.decide_at(start)
    assert first.object_id == 3
    assert "No order was found" in first.reason
    assert "the most promising beginning" in first.reason
    assert stage.decide_at(middle).object_id == 0
    assert len(stage.searches) == 2


@pytest.mark.parametrize(
    ("facts", "mark"),
    [({"bound": 2}, "proved"), ({"bound": 1, "likely": True}, "likely"), ({"bound": 1}, "found")],
)
def test_a_trial_has_the_mark_of_the_answer_that_it_followed(monkeypatch, facts, mark):
    start, middle, end = moment(1), moment(2, REMOVED), moment(3, REMOVED, RETRIEVED)
    stage = Staged(monkeypatch, found(3, 0, states=(start, middle, end), **facts))
    marks = [stage.decide_at(now).evidence.notes["bound"] for now in (start, middle)]
    assert [*marks, stage.planner.bound] == [mark] * 3
