"""Trials that are played elsewhere: what is sent, who refuses to play, and that what comes back is the same.

Without Ray: this process stands for the other machine's, with a child of its own as there.
"""

import os
import pickle
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from test_parcel import tree

from tests.helpers.fake_bench import fake_spec, play_quickly
from torc.benchmark.dispatch import FailureKind
from torc.benchmark.identity import file_fingerprint
from torc.benchmark.local_pool import PoolConfig
from torc.benchmark.playing import OUTPUT, TRIAL, Order
from torc.benchmark.remote import node
from torc.benchmark.remote.aside import Aside
from torc.benchmark.remote.errand import Luggage, Returned, torc_facts
from torc.benchmark.remote.parcel import Parcel
from torc.benchmark.remote.sending import errand_of, pack_luggage, shared_cache, take_home
from torc.benchmark.spec import BenchPlanner
from torc.errors import InputError
from torc.vlm.cache import CacheConfig, CacheMode

LIMITS = PoolConfig(1, 500.0, 4 * 2**30)
PLANNER = """
from helpers_of_travelling import steady

class Mine:
    def decide(self, context, rng):
        raise NotImplementedError
"""


@pytest.fixture(scope="module")
def user(tmp_path_factory):
    """A directory with a planner of the user's, and more."""
    root = tmp_path_factory.mktemp("user")
    (root / "travelling_planner.py").write_text(PLANNER)
    (root / "helpers_of_travelling").mkdir()
    (root / "helpers_of_travelling" / "__init__.py").write_text("steady = 1\n")
    for other in ("venv", ".hidden", "__pycache__"):
        (root / other).mkdir()
        (root / other / "other.py").touch()
    (root / "venv" / "pyvenv.cfg").touch()
    (root / "weights.bin").write_bytes(b"1")
    return root


def _luggage(user, monkeypatch, planners):
    monkeypatch.syspath_prepend(str(user))
    return pack_luggage(LIMITS, [BenchPlanner(p) for p in planners], [], user)


def _order(tmp_path, planner, source=""):
    trial = fake_spec((planner,)).trials[0]
    trial = replace(
        trial,
        planner=replace(trial.planner, source=source),
        problem=replace(trial.problem, name="own", shipped=False),
    )
    (tmp_path / "own.yaml").write_text("its file")
    return Order(trial, str(tmp_path / "own.yaml"), tmp_path / "work")


def test_the_users_files_go_where_a_planner_lies_among_them(user, monkeypatch):
    code = _luggage(user, monkeypatch, ["random", "travelling_planner:Mine"]).code
    assert [name for name, _ in code.files] == ["travelling_planner.py", "helpers_of_travelling/__init__.py"]
    assert code.folders == ()
    assert pack_luggage(LIMITS, [], [], user, grasps="travelling_planner:Mine").code == code


@pytest.mark.parametrize(
    "planners", [["random"], ["random", "torc.task_planning.random_planner:X"], ["no_such:X"]]
)
def test_else_they_stay(user, monkeypatch, planners):
    assert _luggage(user, monkeypatch, planners).code == Parcel()


def test_too_many_files_are_refused(user, monkeypatch):
    monkeypatch.setattr("torc.benchmark.remote.sending._MAX_CODE_FILES", 1)
    with pytest.raises(InputError, match="directory of its own"):
        _luggage(user, monkeypatch, ["travelling_planner:Mine"])


def test_another_torc_does_not_play():
    facts = {**dict(torc_facts()), "torc": "99.0"}
    said = node.answer(tuple(facts.items()), "key", lambda: b"not opened", b"not opened")
    assert "torc is " in said
    assert "not 99.0" in said
    assert "Install the same" in said


@pytest.fixture
def away(user, monkeypatch):
    """Sends an order with the user's files to this process, as it is where these files are not."""
    luggage = pickle.dumps(_luggage(user, monkeypatch, ["travelling_planner:Mine"]))
    monkeypatch.undo()

    def send(order, work=play_quickly):
        errand = pickle.dumps(errand_of(work, order))
        return node.answer(torc_facts(), "away", lambda: luggage, errand)

    yield send
    while node._seats:
        node._seats.popitem()[1].close()


def test_what_comes_back_is_as_if_it_had_been_played_here(away, user, tmp_path):
    source = file_fingerprint(user / "travelling_planner.py")
    order = _order(tmp_path, "travelling_planner:Mine", source)
    play_quickly(order)
    here = tree(order.work)
    returned = away(order)
    assert isinstance(returned, Returned), returned
    assert returned.outcome is None
    take_home(order, returned)
    there = tree(order.work)
    assert there.pop(OUTPUT) == b""
    assert there == here
    assert f'"problem": "{order.problem}"'.encode() in there[f"{TRIAL}/spec.json"]
    # Other trials go to the same child; one of them ends it.
    for planner, kind in (("raises", FailureKind.RAISED), ("aborts", FailureKind.CRASHED), ("random", None)):
        returned = away(_order(tmp_path, planner))
        assert (returned.outcome and returned.outcome.kind) is kind
    assert "differs" in away(_order(tmp_path, "travelling_planner:Mine", "other"))
    assert "no_such_module" in away(_order(tmp_path, "no_such_module:Mine", "any"))
    for grasps, said in (("travelling_planner:Mine", "differs"), ("no_such_grasps:Mine", "no_such_grasps")):
        order = _order(tmp_path, "random")
        settings = replace(order.trial.settings, grasps=grasps, grasps_source="other")
        assert said in away(replace(order, trial=replace(order.trial, settings=settings)))
    (seat,) = node._seats.values()
    assert {p.name for p in seat._root.iterdir()} == {".lock", "code", "objects", "own.yaml"}
    seat.close()
    assert not seat._root.exists()


def test_a_directory_aside_is_removed_when_its_process_was_killed(tmp_path, monkeypatch):
    pytest.importorskip("fcntl")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    script = "import os; from torc.benchmark.remote.aside import Aside; print(Aside().path, flush=True); os._exit(9)"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    mine = Aside()
    said = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    left = Path(said.stdout.strip())
    assert set(tmp_path.iterdir()) == {mine.path, left}
    second = Aside()
    assert set(tmp_path.iterdir()) == {mine.path, second.path}
    second.remove()
    mine.remove()
    assert list(tmp_path.iterdir()) == []


def test_a_cache_has_to_be_seen_by_all_machines(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with shared_cache(CacheConfig(Path("cache"))) as (cache, probe):
        assert cache.directory == tmp_path / "cache"
        seat = node.Seat(Luggage(LIMITS, probe=probe))
        shutil.rmtree(tmp_path / "cache")
        said = seat.play(errand_of(play_quickly, _order(tmp_path, "random"))).text
        seat.close()
        assert f"does not see the VLM cache '{tmp_path / 'cache'}'" in said
    with (
        pytest.raises(InputError, match="to replay from"),
        shared_cache(CacheConfig(Path("no"), CacheMode.REPLAY)),
    ):
        pass
    with shared_cache(None) as nothing:
        assert nothing == (None, None)
