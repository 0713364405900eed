"""Benchmarks without robots."""

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from tests.helpers.fake_bench import InlineBackend, fake_spec, play_quickly
from torc.benchmark.local_pool import Failure, FailureKind
from torc.benchmark.manifest import begin_call
from torc.benchmark.playing import run_missing
from torc.benchmark.rows import PickRow, Table, TrialRow
from torc.benchmark.store import Store
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
    """A table from lists of picks by planner: `made_up(a=[[3, 4], [2, 15]])`, a list per problem; 15 is a failure."""

    def make(
        drops: Sequence[str] = (), references: Sequence[str] = (), **picks: Sequence[Sequence[int]]
    ) -> Table:
        rows = []
        for planner, problems in sorted(picks.items()):
            for i, seeds in enumerate(problems):
                for seed, n in enumerate(seeds):
                    row = _row(planner, i, seed, n, dropped=planner in drops)
                    rows.append(replace(row, participant=planner not in references))
        return Table(Path("x"), tuple(rows))

    return make


@pytest.fixture
def own_problem(tmp_path, monkeypatch) -> tuple[Problem, ObjectModel]:
    """A problem with an object of the user's in it, and that object; its files are those in the store of objects."""
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "objects"))
    mine = replace(load_object("mug_red"), name="my_mug", kind="my_mug", description="the mug of mine")
    save_object(mine, tmp_path / "objects" / "my_mug")
    problem = load_problem("structured-04")
    first, *others = problem.objects
    return replace(problem, name="with-mine", objects=(replace(first, model="my_mug"), *others)), mine


def _row(planner: str, problem: int, seed: int, picks: int, dropped: bool) -> TrialRow:
    got = picks < 15
    pick = PickRow(0, "retrieved" if got else "missed", 0, 1, 0.01, 0.3, 0.1, 7.0, 0, got, None, "")
    facts = {"retrieved": got, "held_target": got, "end": "retrieved" if got else "budget spent"}
    facts |= {"picks": picks, "drops": int(dropped), "picked": (pick,)}
    place = "", Path(f"x/{planner}{problem}{seed}"), f"p{problem:02d}"
    category = "structured" if problem % 2 else "unstructured"
    return TrialRow(*place, category, planner, seed, "completed", **facts)
