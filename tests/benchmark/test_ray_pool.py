"""What the Ray pool does when machines are lost, with a Ray that does as it is told. The real one: test_ray_cluster."""

import pickle
import sys
from types import SimpleNamespace

import pytest

from tests.helpers.fake_bench import fake_spec, play_quickly
from torc.benchmark.dispatch import Failure, FailureKind, Task
from torc.benchmark.local_pool import PoolConfig
from torc.benchmark.playing import OUTPUT, TRIAL, Order
from torc.benchmark.remote.errand import Luggage, Returned
from torc.benchmark.remote.parcel import Parcel
from torc.benchmark.remote.ray_pool import RayPool, load_ray, ray_pool
from torc.errors import InputError, MissingDependencyError, TorcError

LUGGAGE = Luggage(PoolConfig())
ANSWER = Returned("answer", Parcel(((f"{TRIAL}/result.json", b"{}"), (OUTPUT, b"said"))))


class LostError(Exception):
    """Of Ray's own."""


class RaisedError(LostError):
    """An exception on the other machine."""


class MemoryLostError(LostError):
    """The machine had no memory left."""


class ToldRay:
    """Answers each call with what `fate(key, attempt)` gives, an exception to be raised or an answer."""

    exceptions = SimpleNamespace(
        RayError=LostError, RayTaskError=RaisedError, OutOfMemoryError=MemoryLostError
    )

    def __init__(self, fate, cpus=2.0):
        self.fate, self.cpus = fate, cpus
        self.calls, self.flying, self.most = {}, 0, 0

    def put(self, value):
        return value

    def remote(self, **options):
        assert options == {"num_cpus": 1, "max_retries": 0}
        return lambda function: SimpleNamespace(remote=self._call)

    def _call(self, torc, key, luggage, errand):
        name = pickle.loads(errand).key
        self.calls[name] = self.calls.get(name, 0) + 1
        self.flying += 1
        self.most = max(self.most, self.flying)
        return name, self.calls[name]

    def wait(self, refs, num_returns, timeout):
        return refs[:num_returns], refs[num_returns:]

    def get(self, ref):
        self.flying -= 1
        answer = self.fate(*ref)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def cluster_resources(self):
        return {"CPU": self.cpus} if self.cpus else {}


def _tasks(tmp_path):
    orders = [Order(t, t.problem.name, tmp_path / t.id[:8]) for t in fake_spec().trials]
    return [Task(o.trial.id, o, o.work / OUTPUT) for o in orders]


def _run(ray, tasks, workers=0):
    said = []
    pool = RayPool(ray, LUGGAGE, workers, said.append)
    return pool.run(play_quickly, tasks), said


def test_every_task_ends_once_though_what_was_at_it_is_lost(tmp_path):
    tasks = _tasks(tmp_path)
    ray = ToldRay(
        lambda key, n: LostError("the node died\nlong story") if n <= int(key[0], 16) % 4 else ANSWER
    )
    endings, said = _run(ray, tasks)
    assert {e.key: e.outcome for e in endings} == {t.key: "answer" for t in tasks}
    assert ray.calls == {t.key: 1 + int(t.key[0], 16) % 4 for t in tasks}
    assert said[0] == "A trial is played again, since what was at it is lost: the node died"
    assert all((t.argument.work / TRIAL / "result.json").read_bytes() == b"{}" for t in tasks)
    assert all(t.log.read_bytes() == b"said" for t in tasks)


@pytest.mark.parametrize(
    ("error", "kind"),
    [(LostError("died"), FailureKind.CRASHED), (MemoryLostError("full"), FailureKind.MEMORY)],
)
def test_a_task_that_is_lost_again_and_again_costs_only_itself(tmp_path, error, kind):
    tasks = _tasks(tmp_path)
    endings, _ = _run(ToldRay(lambda key, n: error if key == tasks[1].key else ANSWER), tasks)
    outcomes = {e.key: e.outcome for e in endings}
    assert len(outcomes) == len(tasks)
    lost = outcomes.pop(tasks[1].key)
    assert isinstance(lost, Failure)
    assert lost.kind is kind
    assert set(outcomes.values()) == {"answer"}


def test_a_cluster_that_cannot_play_is_given_up(tmp_path):
    endings, _ = _run(ToldRay(lambda key, n: RaisedError("Traceback\nOSError: no space")), _tasks(tmp_path))
    with pytest.raises(TorcError, match="cannot play: OSError: no space"):
        list(endings)


def test_a_cluster_that_is_lost_as_a_whole_is_explained(tmp_path):
    ray = ToldRay(lambda key, n: ANSWER)
    endings, _ = _run(ray, _tasks(tmp_path))
    next(endings)

    def gone(*arguments, **options):
        raise LostError("no head")

    ray.wait = gone
    with pytest.raises(TorcError, match=r"no head.*The same command goes on"):
        list(endings)


def test_a_machine_with_another_torc_ends_it(tmp_path):
    ray = ToldRay(lambda key, n: "far cannot play: another torc")
    with pytest.raises(InputError, match="far cannot play"):
        list(_run(ray, _tasks(tmp_path))[0])


@pytest.mark.parametrize(("cpus", "workers", "most"), [(8, 0, 11), (8, 3, 3), (2, 8, 3), (0, 0, 1)])
def test_a_bounded_number_is_in_flight(tmp_path, cpus, workers, most):
    ray = ToldRay(lambda key, n: ANSWER, cpus)
    endings, said = _run(ray, _tasks(tmp_path), workers)
    list(endings)
    assert ray.most == most
    assert bool(said) == (cpus == 0)


def test_a_missing_extra_is_explained(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingDependencyError, match="scripts/setup ray"):
        load_ray()


def test_the_address_of_a_client_is_explained(monkeypatch):
    monkeypatch.setattr("torc.benchmark.remote.ray_pool.load_ray", lambda: None)
    with pytest.raises(InputError, match="--ray auto"), ray_pool("ray://head:10001", 0, LUGGAGE):
        pass


@pytest.mark.parametrize("address", ["127.0.0.1:1", "127.0.0.1:99999", "[::1]:1"])
def test_an_address_where_nobody_answers_is_refused_at_once(monkeypatch, address):
    monkeypatch.setattr("torc.benchmark.remote.ray_pool.load_ray", lambda: None)
    with pytest.raises(InputError, match=r"No Ray cluster.*ray start --head"), ray_pool(address, 0, LUGGAGE):
        pass


@pytest.mark.parametrize("address", ["head", "head:", ":6379", "head:six"])
def test_what_is_no_address_is_refused(monkeypatch, address):
    monkeypatch.setattr("torc.benchmark.remote.ray_pool.load_ray", lambda: None)
    with pytest.raises(InputError, match="HOST:PORT"), ray_pool(address, 0, LUGGAGE):
        pass
