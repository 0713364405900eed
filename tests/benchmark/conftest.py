"""Benchmarks without robots."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.helpers.fake_bench import InlineBackend, fake_spec, made_up_table, play_quickly
from torc.benchmark.local_pool import Failure, FailureKind
from torc.benchmark.playing import run_missing
from torc.benchmark.rows import Table
from torc.benchmark.store import Store, begin_call
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.objects.object_files import save_object
from torc.problems.problem import Problem, load_problem

STRANGE = "<b>&amp;|`*_"


@pytest.fixture(scope="session")
def played(tmp_path_factory) -> Path:
    """Three planners on four problems, three times, one errored, two missing; and one by a person who saw more."""
    root = tmp_path_factory.mktemp("played") / "my benchmark"
    spec, store = fake_spec(("random", "dg-select", f"mine:{STRANGE}")), Store(root)
    failure = Failure(FailureKind.CRASHED, f"Its process was ended by SIGSEGV {STRANGE}.")
    with store.locked():
        store.extend(spec, {})
        begin_call(root, workers=1)
        backend = InlineBackend({spec.trials[2].id: failure})
        run_missing(store, spec, backend, work=play_quickly, limit=len(spec.trials) - 2)
    human = root / "human" / "structured-01-human-anna-0"
    shutil.copytree(store.directory(spec.trials[0]), human)
    facts = json.loads((human / "spec.json").read_text())
    facts["planner"] |= {"name": "human", "expert": "anna", "outside_view": True}
    (human / "spec.json").write_text(json.dumps(facts))
    result = json.loads((human / "result.json").read_text())
    (human / "result.json").write_text(json.dumps({**result, "participant": False}))
    return root


@pytest.fixture(scope="session")
def made_up() -> Callable[..., Table]:
    return made_up_table


@pytest.fixture
def own_problem(tmp_path, monkeypatch) -> tuple[Problem, ObjectModel]:
    """A problem with an object of the user's in it, and that object; its files are those in the store of objects."""
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "objects"))
    mine = replace(load_object("mug_red"), name="my_mug", kind="my_mug", description="the mug of mine")
    save_object(mine, tmp_path / "objects" / "my_mug")
    problem = load_problem("structured-04")
    first, *others = problem.objects
    return replace(problem, name="with-mine", objects=(replace(first, model="my_mug"), *others)), mine
