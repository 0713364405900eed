"""What the Ray pool makes of what Ray says, and what a machine plays. The real one: test_ray_cluster."""

import json
import os
import shutil
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.helpers.fake_bench import fake_spec, play_quickly
from torc.benchmark import ray_worker
from torc.benchmark.local_pool import FailureKind, PoolConfig, Task
from torc.benchmark.playing import Order, changed_part
from torc.benchmark.ray_pool import RayPool, ray_pool
from torc.benchmark.spec import Around, BenchPlanner, BenchProblem, problem_fingerprint
from torc.benchmark.store import OUTPUT, TRIAL
from torc.errors import InputError, TorcError
from torc.io.digests import file_fingerprint
from torc.problems.problem import load_problem, save_problem
from torc.robots.loading import own_source
from torc.robots.schema import EXAMPLE
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec
from torc.workspace.workspace_files import EXAMPLE as WORKSPACE
from torc.workspace.workspace_files import own_workspace_source

LIMITS = PoolConfig(0, 500.0, 4 * 2**30)


class LostError(Exception):
    """Of Ray's own."""


class RaisedError(LostError):
    """An exception on the other machine."""

    cause = InputError("far is another torc")


class MemoryLostError(LostError):
    """The machine had no memory left."""


class FakeRay:
    """Raises what it is told to at every answer; else the trial is played in this process."""

    __version__ = "0"
    exceptions = SimpleNamespace(
        RayError=LostError,
        RayTaskError=RaisedError,
        RuntimeEnvSetupError=RaisedError,
        OutOfMemoryError=MemoryLostError,
    )

    def __init__(self, error=None, working_dir=None):
        self.error, self.working_dir = error, working_dir

    def init(self, address, runtime_env, **options):
        shutil.copytree(runtime_env["working_dir"], self.working_dir)
        self.environment = runtime_env["env_vars"]

    def shutdown(self):
        pass

    def cluster_resources(self):
        return {"CPU": 2.0}

    def remote(self, **options):
        assert options == {"num_cpus": 1, "max_retries": 5}
        return lambda function: SimpleNamespace(remote=lambda *sent: partial(function, *sent))

    def wait(self, refs):
        return refs[:1], refs[1:]

    def get(self, call):
        if self.error is not None:
            raise self.error
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(self.working_dir)
            patch.setattr(sys, "path", list(sys.path))
            for name, value in self.environment.items():
                patch.setenv(name, value)
            try:
                return call()
            except InputError as error:
                raised = RaisedError()
                raised.cause = error
                raise raised from error


def _tasks(tmp_path):
    orders = [Order(t, t.problem.name, tmp_path / t.id[:8]) for t in fake_spec().trials]
    return [Task(o.trial.id, o, o.work / OUTPUT) for o in orders]


def _run(ray, tasks):
    return list(RayPool(ray, LIMITS, {}).run(play_quickly, tasks))


@pytest.mark.parametrize(
    ("error", "kind"),
    [(LostError("died"), FailureKind.CRASHED), (MemoryLostError("full"), FailureKind.MEMORY)],
)
def test_a_trial_that_is_lost_on_every_machine_is_errored(tmp_path, error, kind):
    for ending in _run(FakeRay(error), _tasks(tmp_path)):
        assert ending.failure.kind is kind
        assert str(error) in ending.failure.text


def test_a_machine_that_cannot_play_ends_it(tmp_path):
    with pytest.raises(TorcError, match="cannot play: far is another torc"):
        _run(FakeRay(RaisedError()), _tasks(tmp_path))


@pytest.mark.parametrize("address", ["127.0.0.1:1", "head"])
def test_an_address_where_no_cluster_answers_is_refused_at_once(monkeypatch, address):
    monkeypatch.setattr("torc.benchmark.ray_pool.load_ray", lambda: FakeRay)
    with (
        pytest.raises(InputError, match=r"No Ray cluster.*HOST:PORT.*ray start --head"),
        ray_pool(address, LIMITS, fake_spec(), {}),
    ):
        pass


PARTS = """
from helpers_of_mine import steady

class Decides:
    def decide(self, context, rng): ...

class Grasps:
    def plan(self, scene, volume, rng): ...
"""


def as_planned(order):
    """In the child process: whether it finds all of the user's own files, and they are the same."""
    print("looks")
    play_quickly(order)
    same = problem_fingerprint(load_problem(order.problem)) == order.trial.problem.digest
    return changed_part(order.trial), same, os.environ["TORC_OBJECTS"]


@pytest.fixture
def own(own_problem, tmp_path, monkeypatch):
    """A spec whose planner, grasp planner, robot, problem and object are the user's, and the problem."""
    here = tmp_path / "user"
    shutil.copytree(EXAMPLE.parent, here / "robot")
    shutil.copytree(EXAMPLE.parent.parent / "shared", here / "shared")
    (here / "parts_of_mine.py").write_text(PARTS)
    (here / "helpers_of_mine").mkdir()
    (here / "helpers_of_mine" / "__init__.py").write_text("steady = 1\n")
    for other in (".hidden", "__pycache__"):
        (here / other).mkdir()
        (here / other / "other.py").touch()
    monkeypatch.chdir(here)
    problem, _ = own_problem
    save_problem(problem, here / "with-mine.yaml")
    robot, source = f"robot/{EXAMPLE.name}", file_fingerprint(here / "parts_of_mine.py")
    (here / "table.yaml").write_text(WORKSPACE.read_text() + "# mine\n")
    around = Around(
        Conditions(robot=robot, workspace="table.yaml", grasps="parts_of_mine.py:Grasps"),
        {"robot": own_source(robot), "workspace": own_workspace_source("table.yaml"), "grasps": source},
    )
    planned = BenchProblem("with-mine", "structured", problem_fingerprint(problem), shipped=False)
    planner = BenchPlanner(PlannerSpec("parts_of_mine:Decides"), source=source)
    trial = replace(fake_spec().trials[0], problem=planned, planner=planner, around=around)
    return replace(fake_spec(), around=around, trials=(trial,)), {"with-mine": problem}


@pytest.fixture
def away(own, tmp_path, monkeypatch):
    """Plays in this process, with a child of its own, as on a machine that has none of the user's files."""
    spec, problems = own
    ray = FakeRay(working_dir=tmp_path / "away")
    monkeypatch.setattr("torc.benchmark.ray_pool.load_ray", lambda: ray)

    def play(work):
        (trial,) = spec.trials
        order = Order(trial, str(Path("with-mine.yaml").absolute()), tmp_path / "work")
        with ray_pool("auto", LIMITS, spec, problems) as pool:
            for name in ("user", "objects"):
                (tmp_path / name).rename(tmp_path / f"{name}-gone")
            (ending,) = pool.run(work, [Task(trial.id, order, order.work / OUTPUT)])
        return ending, order

    yield play
    ray_worker._pool(replace(LIMITS, workers=1)).close()


@pytest.mark.long
def test_the_users_own_files_are_there_and_what_comes_back_names_those_here(away, tmp_path):
    ending, order = away(as_planned)
    assert ending.outcome == (None, True, "own-objects")
    facts = json.loads((order.work / TRIAL / "spec.json").read_text())
    here = order.trial.around.conditions
    assert (facts["problem"], facts["conditions"]["robot"]) == (order.problem, here.robot)
    assert facts["conditions"]["workspace"] == here.workspace
    assert (order.work / OUTPUT).read_text() == "looks\n"
    there = tmp_path / "away" / "own-code"
    code = {p.relative_to(there).as_posix() for p in there.rglob("*") if p.is_file()}
    assert code == {"parts_of_mine.py", "helpers_of_mine/__init__.py"}


def test_another_torc_does_not_play(away, monkeypatch):
    facts = ray_worker.torc_facts()
    monkeypatch.setattr("torc.benchmark.ray_pool.torc_facts", lambda: {**facts, "torc": "99.0"})
    with pytest.raises(TorcError, match=r"torc is .*, not 99\.0.*Install the same"):
        away(play_quickly)
