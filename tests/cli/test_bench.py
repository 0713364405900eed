"""`torc bench` and `torc report` as a user meets them, with trials that take no time."""

import json
import os
import shutil
from itertools import product

import pytest

from tests.helpers.fake_bench import InlineBackend, play_quickly
from tests.helpers.torc_command import run_torc
from torc.benchmark.local_pool import Failure, FailureKind
from torc.benchmark.playing import play
from torc.benchmark.reading import read_table, read_tables
from torc.benchmark.report.ranking import rank, verdict
from torc.benchmark.rows import pick_records, trial_records
from torc.benchmark.store import calls
from torc.io.digests import forget_files
from torc.problems.problem import load_problem, problem_text

PROBLEMS = "structured-04,unstructured-02"
PLANNER = """
class Mine:
    name = "mine"

    def decide(self, context, rng):
        raise NotImplementedError("{}")
"""


@pytest.fixture
def bench(monkeypatch, tmp_path, capsys):
    """Calls `torc bench` with a pool that plays at once; `bench.failures` makes trials fail."""
    failures = {}

    class Quick(InlineBackend):
        def __init__(self, config):
            super().__init__(failures)

        def run(self, work, tasks):
            return super().run(play_quickly if work is play else work, tasks)

    monkeypatch.setattr("torc.benchmark.local_pool.LocalPool", Quick)
    monkeypatch.setattr("torc.pipeline.warm_up.kernel_cache", lambda: (tmp_path, True))

    def call(*arguments, problems=PROBLEMS, out=tmp_path / "out"):
        forget_files()  # as a new process would
        return run_torc("bench", "--problems", problems, "--out", out, *arguments, capsys=capsys)

    call.failures = failures
    return call


def test_it_plays_all_and_says_what_comes_next(bench, tmp_path):
    code, out, err = bench("--repeats", 2)
    assert code == 0
    assert out == ""
    assert "8 trials, 0 complete already, 8 to play now." in err
    assert "[8/8] dg-select on unstructured-02, seed 1: " in err
    assert f"torc report {tmp_path / 'out'}" in err
    rows = read_table(tmp_path / "out").rows
    wanted = product(("random", "dg-select"), PROBLEMS.split(","), (0, 1))
    assert {(r.planner, r.problem, r.seed) for r in rows} == set(wanted)
    (call,) = json.loads((tmp_path / "out" / "manifest.json").read_text())["calls"]
    assert (call["played"], call["missing"]) == (8, 0)
    assert {"torc", "numpy", "mujoco-core"} <= set(call["versions"])
    assert call["machine"]["cores"] == os.cpu_count()


def test_it_goes_on_where_it_was(bench):
    assert bench("--repeats", 1, "--limit", 3)[0] == 0
    _, out, err = bench("--repeats", 1, "--json")
    assert "4 trials, 3 complete already, 1 to play now." in err
    facts = {"trials": 4, "played": 1, "errored": 0, "missing": 0}
    assert json.loads(out) | {"directory": ""} == facts | {"directory": ""}
    _, _, err = bench("--repeats", 2)
    assert "8 trials, 4 complete already, 4 to play now." in err


def test_seeds_may_begin_where_other_trials_ended(bench, tmp_path):
    bench("--repeats", 1, out=tmp_path / "before")
    bench("--repeats", 2, "--first-seed", 1, out=tmp_path / "after")
    table = read_tables([tmp_path / "before", tmp_path / "after"])
    assert table.left_out == ()
    assert {r.seed for r in read_table(tmp_path / "after").rows} == {1, 2}
    bench("--repeats", 3)
    assert [r.cell for r in table.rows] == [r.cell for r in read_table(tmp_path / "out").rows]


def test_it_says_that_it_goes_on_under_other_versions(bench, tmp_path, monkeypatch):
    assert "other versions" not in bench("--limit", 3)[2] + bench("--limit", 1)[2]
    monkeypatch.setattr("torc.trials.versions.version_of", lambda name: "9.9" if name == "numpy" else "1.0")
    assert "were played with other versions: mujoco-core" in bench("--limit", 1)[2]
    table = read_table(tmp_path / "out")
    warnings = " ".join(verdict(table, rank(table)).warnings)
    assert "numpy 9.9" in warnings


def test_shards_make_the_same_table_together(bench, tmp_path):
    for i in (1, 2, 3):
        _, _, err = bench("--repeats", 2, "--shard", f"{i}/3", out=tmp_path / "shards" / str(i))
        assert f"Shard {i}/3: {2 if i == 3 else 3} trials, 0 complete already" in err
    bench("--repeats", 2)
    records = []
    for roots in ([tmp_path / "out"], sorted((tmp_path / "shards").iterdir())):
        table = read_tables(roots)
        assert table.left_out == ()
        plain = [{**record, "directory": ""} for record in trial_records(table)]
        records.append((plain, pick_records(table)))
    assert records[0] == records[1]
    (call,) = calls(tmp_path / "shards" / "2")
    assert call["shard"] == "2/3"
    again = bench("--repeats", 2, "--shard", "2/3", out=tmp_path / "shards" / "2")[2]
    assert "3 complete already, 0 to play now" in again


def test_errored_trials_make_the_exit_code_1(bench, tmp_path):
    bench("--repeats", 1)
    lost = read_table(tmp_path / "out").rows[0]
    shutil.rmtree(lost.directory)
    bench.failures[lost.id] = Failure(FailureKind.CRASHED, "Its process was ended by SIGSEGV.")
    code, _, err = bench("--repeats", 1)
    assert code == 1
    assert "ERRORED: Its process was ended by SIGSEGV." in err


def test_a_dry_run_leaves_nothing(bench, tmp_path):
    code, _, err = bench("--repeats", 1, "--dry-run")
    assert code == 0
    assert "random on structured-04, seed 0" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--planners", "random:simulated"], "'random' asks no model"),
        (["--planners", "vlm-select:simulated,vlm-grasps"], "asks a model: name it"),
        (["--planners", "random", "--vlm-seeded"], "no --vlm"),
        (["--planners", "dgselect"], "Did you mean 'dg-select'?"),
        (["--planners", "human"], "torc human"),
        (["--planners", "vlm-select"], "--vlm"),
        (["--planners", "random,random"], "More than one planner"),
        (["--planners", ""], "nothing to play"),
        (["--planners", "no_such_module:Mine"], "no_such_module"),
        (["--timeout", "0"], "--timeout"),
        (["--first-seed", "-1"], "--first-seed at least 0"),
        (["--shard", "3/2"], "I from 1 to N"),
        (["--repeats", "1", "--shard", "5/5"], "holds none of the 4 trials"),
        (["--grasps", "json:JSONDecoder"], "needs a method `plan(scene, volume, rng)`"),
    ],
)
def test_bad_arguments_are_explained_and_leave_nothing(bench, arguments, said, tmp_path):
    code, _, err = bench(*arguments)
    assert code == 2
    assert said in err
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_compared_is_refused(bench):
    bench("--repeats", 1)
    for more in ([], ["--dry-run"]):
        code, _, err = bench("--repeats", 1, "--noise", *more)
        assert code == 2
        assert "noise False there, True now" in err


def test_a_planner_that_was_changed_is_played_again(bench, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    module = tmp_path / "changing_planner.py"
    module.write_text(PLANNER.format("one"))
    arguments = ("--planners", "random,changing_planner:Mine", "--repeats", 1)
    bench(*arguments)
    assert "4 complete already" in bench(*arguments)[2]
    module.write_text(PLANNER.format("two"))
    assert "2 complete already, 2 to play now" in bench(*arguments)[2]
    table = read_table(tmp_path / "out")
    assert len(table.rows) == 4
    assert len(table.left_out) == 2


def test_settings_are_compared_as_planners_are(bench, tmp_path):
    code, _, err = bench("--planners", "random", "--repeats", 1, "--sweep", "occlusion.smooth_px=0,3")
    assert code == 0
    assert "4 trials, 0 complete already, 4 to play now." in err
    table = read_table(tmp_path / "out")
    assert table.planners == ("random {smooth_px=0}", "random {smooth_px=3}")
    assert {len(table.completed(planner)) for planner in table.planners} == {2}
    again = bench("--planners", "random", "--repeats", 1, "--sweep", "occlusion.smooth_px=0")[2]
    assert "0 to play now" in again
    code, _, err = bench("--planners", "random", "--sweep", "occlusion.smooth_px=4", out=tmp_path / "other")
    assert (code, (tmp_path / "other").exists()) == (2, False)
    assert "must be 0, 3 or 5" in err


def test_ones_own_problem_is_kept_as_it_was_played(bench, tmp_path):
    mine = tmp_path / "mine.yaml"
    text = problem_text(load_problem("structured-04")).replace("name: structured-04", "name: mine", 1)
    mine.write_text(text)
    bench("--repeats", 1, problems=str(mine))
    assert (tmp_path / "out" / "problems" / "mine.yaml").read_text() == text
    assert {r.problem for r in read_table(tmp_path / "out").rows} == {"mine"}
    mine.write_text(text.replace("position: [", "position: [ ").replace("description: ", "description: not "))
    code, _, err = bench("--repeats", 1, problems=str(mine))
    assert code == 2
    assert "changed since: mine" in err


def test_report_answers_in_json(bench, tmp_path, monkeypatch, capsys):
    bench("--repeats", 2)
    monkeypatch.setattr("torc.benchmark.report.writing.draw_all", lambda table, planners: [])
    code, out, _ = run_torc("report", tmp_path / "out", "--json", capsys=capsys)
    assert code == 0
    said = json.loads(out)
    assert said["planner"] in ("random", "dg-select")
    assert [p["completed"] for p in said["ranking"]] == [4, 4]
    assert (tmp_path / "out" / "report" / "index.html").is_file()
    code, out, _ = run_torc("report", tmp_path / "out", "--out", tmp_path / "there", capsys=capsys)
    assert code == 0
    assert out.splitlines()[0] == said["answer"]
    assert f"torc view {tmp_path / 'out'}" in out
    assert (tmp_path / "there" / "report.md").is_file()
