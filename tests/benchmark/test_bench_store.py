"""A store holds whole trials only, whenever its runner was stopped; what is missing or errored is played again."""

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from tests.helpers.fake_bench import InlineBackend, fake_spec, play_quickly
from torc.benchmark import store as store_module
from torc.benchmark.local_pool import Failure, FailureKind
from torc.benchmark.playing import run_missing
from torc.benchmark.reading import read_table
from torc.benchmark.rows import trial_records
from torc.benchmark.spec import planned
from torc.benchmark.store import Store
from torc.errors import InputError

CHECKOUT = Path(__file__).parents[2]


def _play(root, spec, backend=None, **options):
    store, heard, errored = Store(root), [], []

    def listener(trial, result):
        heard.append(trial)
        errored.extend([] if result.completed else [trial])

    with store.locked():
        store.extend(spec, {})
        options = {"listener": listener, "work": play_quickly} | options
        run_missing(store, spec, backend or InlineBackend(), **options)
    return store, heard, errored


def _table(root):
    return trial_records(read_table(root))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The table of a benchmark that nothing came in the way of."""
    root = tmp_path_factory.mktemp("whole")
    _play(root, fake_spec())
    return _table(root)


def test_errored_trials_are_kept_with_their_cause_and_played_again(tmp_path, whole):
    spec = fake_spec()
    bad = spec.trials[3]
    failure = Failure(FailureKind.CRASHED, "Its process was ended by SIGSEGV.")
    store, heard, errored = _play(tmp_path, spec, InlineBackend({bad.id: failure}))
    assert errored == [bad]
    assert len(heard) == len(spec.trials)
    assert store.left(spec) == [bad]
    (row,) = [r for r in read_table(tmp_path).rows if r.id == bad.id]
    assert (row.status, row.cause, row.error) == ("errored", "crashed", "Its process was ended by SIGSEGV.")
    assert "what it printed" in (store.directory(bad) / "error.txt").read_text()
    assert json.loads((store.directory(bad) / "spec.json").read_text())["seed"] == bad.seed
    _, heard, _ = _play(tmp_path, spec)
    assert heard == [bad]
    assert _table(tmp_path) == whole


class Killed(BaseException):
    """Stands for SIGKILL: nobody catches it."""


@pytest.mark.long
def test_killed_at_any_change_of_the_disk_it_ends_with_the_same_table(tmp_path, monkeypatch):
    spec = fake_spec(problems=2, repeats=1)
    failure = {spec.trials[1].id: Failure(FailureKind.HUNG, "It was ended.")}
    _play(tmp_path / "whole", spec)
    expected = _table(tmp_path / "whole")
    countdown = [0]

    def counted(function):
        def call(*arguments, **options):
            countdown[0] -= 1
            if countdown[0] == 0:
                raise Killed
            return function(*arguments, **options)

        return call

    monkeypatch.setattr(os, "replace", counted(os.replace))
    monkeypatch.setattr(shutil, "rmtree", counted(shutil.rmtree))
    monkeypatch.setattr(store_module, "write_json", counted(store_module.write_json))
    steps = 0
    for kill_at in range(1, 1000):
        root, countdown[0] = tmp_path / str(kill_at), kill_at
        try:
            _play(root, spec, InlineBackend(failure))
            _play(root, spec)
        except Killed:
            steps += 1
            countdown[0] = 0
            _play(root, spec)
            assert _table(root) == expected
        else:
            break
    assert steps > 20


def test_another_runner_is_kept_out(tmp_path):
    pytest.importorskip("fcntl")
    with Store(tmp_path).locked(), pytest.raises(InputError, match="Another"), Store(tmp_path).locked():
        pass
    with Store(tmp_path).locked():
        pass


def test_other_planners_join_and_superseded_trials_do_not_count(tmp_path):
    _play(tmp_path, fake_spec(("random",)))
    _play(tmp_path, fake_spec(("dg-select",)))
    assert read_table(tmp_path).planners == ("dg-select", "random")
    store = Store(tmp_path)
    old = fake_spec(("random",))
    trials = (planned(t.problem, t.planner, t.seed, old.around, "0.1") for t in old.trials)
    new = replace(old, trials=tuple(trials))
    _play(tmp_path, new)
    table = read_table(tmp_path)
    assert len(table.rows) == 2 * len(old.trials)
    assert len(table.left_out) == len(old.trials)
    assert {r.id for r in table.rows if r.planner == "random"} == {t.id for t in new.trials}
    assert store.left(new) == []
