"""The tables of the benchmarks say what the trials on disk say. The trials here are made up."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
PROBLEMS = ("structured-04", "unstructured-02")


@pytest.fixture
def scripts(monkeypatch):
    """The benchmarks' modules, importable as they are for who runs one of them; forgotten afterwards."""
    before = set(sys.modules)
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield
    for name in set(sys.modules) - before:
        if str(BENCHMARKS) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def _trial(out, problem, planner, seed, picks, drops=0, retrieved=True, status="completed"):
    path = out / f"{problem}-{planner}-{seed}"
    path.mkdir(parents=True)
    result = {"status": status}
    if status == "completed":
        result |= {"retrieved": retrieved, "picks": picks, "drops": drops, "end": "retrieved"}
        result |= {"outcomes": ["removed"] * (picks - 1) + ["retrieved"], "seconds": {"all": 1.0}}
        result |= {"grasps_held": picks, "grasps_executed": picks}
    (path / "result.json").write_text(json.dumps(result))
    (path / "events.jsonl").write_text("")


@pytest.fixture
def trials(tmp_path):
    """RANDOM on two problems, three seeds; of the second problem one trial failed and one errored."""
    for seed, picks in enumerate((3, 5, 4)):
        _trial(tmp_path, PROBLEMS[0], "random", seed, picks, drops=seed // 2)
    _trial(tmp_path, PROBLEMS[1], "random", 0, 8)
    _trial(tmp_path, PROBLEMS[1], "random", 1, 15, drops=3, retrieved=False)
    _trial(tmp_path, PROBLEMS[1], "random", 2, 0, status="errored")
    return tmp_path


@pytest.fixture
def facts(monkeypatch, scripts):
    """Difficulties that take no time to measure."""
    import problem_table
    from torc.generation.config import Hiddenness
    from torc.generation.difficulty import Difficulty

    made = {
        PROBLEMS[0]: Difficulty(9, Hiddenness.HIDDEN, 0.0, 1, 3, 3),
        PROBLEMS[1]: Difficulty(14, Hiddenness.PARTLY, 0.13, 5, 5, 8),
    }
    monkeypatch.setattr(problem_table, "difficulties", lambda problems: {n: made[n] for n in problems})


def _main(monkeypatch, module, *arguments):
    monkeypatch.setattr(sys, "argv", ["benchmark", *map(str, arguments)])
    module.main()


def _cells(text, *first):
    """The cells of the only row that begins with these."""
    rows = [[c.strip() for c in line[1:-1].split("|")] for line in text.splitlines() if line[:1] == "|"]
    (row,) = [r for r in rows if r[: len(first)] == list(first)]
    return row


def test_the_tables_of_made_up_trials(trials, facts, monkeypatch, capsys):
    import retrieval

    arguments = ("--planners", "random", "oracle", "--seeds", 3, "--table-only", "--per-problem")
    _main(monkeypatch, retrieval, "--out", trials, "--problems", ",".join(PROBLEMS), *arguments)
    text = (trials / "table.md").read_text()
    assert text.strip() == capsys.readouterr().out.strip()

    cells = _cells(text, "random", "all")
    assert cells[2:4] == ["6", "1"]
    starts = [cell.split(" [")[0] for cell in cells[4:]]
    assert starts == ["0.80", "0.60", "5.0", "7.0", "0.80", "1.00", ""]
    # One problem alone: drawn again and again, it is always the same.
    alone = " | ".join(_cells(text, "random", "structured")[4:9])
    assert alone == (
        "1.00 [1.00, 1.00] | 0.67 [0.67, 0.67] | 4.0 [4.0, 4.0] | 4.0 [4.0, 4.0] | 0.33 [0.33, 0.33]"
    )

    # ORACLE has not played: its cells are empty.
    row = " | ".join(_cells(text, "structured-04"))
    assert row == "structured-04 | structured | 9 | 0 | hidden | 4 (3-5) | 1.00 | 0.67 | 0.33 |  |  |  | "
    assert _cells(text, "unstructured-02")[5:9] == ["11.5 (8-15)", "0.50", "0.50", "1.50"]
    row = " | ".join(_cells(text, "all"))
    assert row == "all | 2 | 11.5 (9-14) | 0 / 1 / 1 | 6.5 (0-13) | 3 (1-5) | 4 (3-5) | 5.5 (3-8)"
    assert _cells(text, "unstructured")[1:4] == ["1", "14 (14-14)", "0 / 1 / 0"]


def test_without_being_asked_there_is_no_row_per_problem(trials, facts, monkeypatch, capsys):
    import retrieval

    arguments = ("--planners", "random", "--seeds", 3, "--table-only")
    _main(monkeypatch, retrieval, "--out", trials, "--problems", ",".join(PROBLEMS), *arguments)
    assert "structured-04" not in capsys.readouterr().out


def test_intervals_draw_problems_and_not_trials(scripts, rng):
    from intervals import interval, mean

    # Alike within a problem: twenty trials of each tell no more than one does.
    values = rng.normal(5.0, 2.0, 12)
    few = [{"problem": f"p{i}", "picks": value} for i, value in enumerate(values)]
    many = [row for row in few for _ in range(20)]
    assert interval(few, mean("picks")) == interval(many, mean("picks"))
    low, high = (float(v) for v in interval(few, mean("picks"), digits=6).split("[")[1].strip("]").split(","))
    normal = 1.96 * values.std() / np.sqrt(len(values))
    assert low == pytest.approx(values.mean() - normal, abs=0.25 * normal)
    assert high == pytest.approx(values.mean() + normal, abs=0.25 * normal)


def test_the_oracle_solves_what_is_missing_and_no_more(scripts, tmp_path, monkeypatch, capsys):
    import oracle

    asked = []

    def solve(problem, seed, budget, likely):
        asked.append((problem, seed, budget, likely))
        numbers = {"picks": 2, "drops": 0, "lower_bound": 2, "rough_bound": 2, "picks_tried": 3, "looks": 4}
        return {"problem": problem, "seed": seed, "objects": 9, "solved": True, "proved": True} | {
            **numbers,
            "first_s": 1.0,
            "all_s": 2.0,
        }

    def run_here(work, jobs, workers):
        for job in jobs:
            print(work(*job))

    monkeypatch.setattr(oracle, "solve", solve)
    monkeypatch.setattr(oracle, "run_jobs", run_here)
    arguments = ("--out", tmp_path, "--problems", ",".join(PROBLEMS), "--budget", 5)
    _main(monkeypatch, oracle, *arguments, "--seeds", 1)
    assert asked == [(PROBLEMS[0], 0, 5.0, False), (PROBLEMS[1], 0, 5.0, False)]
    _main(monkeypatch, oracle, *arguments, "--seeds", 2, "--likely")
    assert asked[2:] == [(PROBLEMS[0], 1, 5.0, True), (PROBLEMS[1], 1, 5.0, True)]
    assert "structured-04-1: 2 picks, proved, 2 s" in capsys.readouterr().out
    assert "Solved 4 of 4, proved 4" in (tmp_path / "table.md").read_text()
    assert sorted(p.name for p in tmp_path.iterdir())[:2] == ["structured-04-0.json", "structured-04-1.json"]
    assert not list(tmp_path.glob("*.partial"))


def test_jobs_run_in_processes_of_their_own(scripts, capfd):
    from processes import run_jobs

    run_jobs("{}-{}".format, [("a", 1), ("b", 2)], workers=2)
    lines = capfd.readouterr().out.splitlines()
    assert sorted(line.split()[1] for line in lines) == ["a-1", "b-2"]
    assert [line.split()[0] for line in lines] == ["[1/2]", "[2/2]"]
