"""The benchmarks that solve: what is missing is sought, in processes of their own."""

import sys

from benchmarks import oracle
from benchmarks.processes import run_jobs

PROBLEMS = ("structured-04", "unstructured-02")


def _main(monkeypatch, module, *arguments):
    monkeypatch.setattr(sys, "argv", ["benchmark", *map(str, arguments)])
    module.main()


def test_the_oracle_solves_what_is_missing_and_no_more(tmp_path, monkeypatch, capsys):
    asked = []

    def solve(problem, seed, budget, likely):
        asked.append((problem, seed, budget, likely))
        numbers = {"picks": 2, "drops": 0, "lower_bound": 2, "picks_tried": 3, "looks": 4}
        return {"problem": problem, "seed": seed, "objects": 9, "solved": True, "bound": "proved"} | {
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
    assert "Solved 4 of 4; 4 proved" in (tmp_path / "table.md").read_text()
    assert sorted(p.name for p in tmp_path.iterdir())[:2] == ["structured-04-0.json", "structured-04-1.json"]
    assert not list(tmp_path.glob("*.partial"))


def test_jobs_run_in_processes_of_their_own(capfd):
    run_jobs("{}-{}".format, [("a", 1), ("b", 2)], workers=2)
    lines = capfd.readouterr().out.splitlines()
    assert sorted(line.split()[1] for line in lines) == ["a-1", "b-2"]
    assert [line.split()[0] for line in lines] == ["[1/2]", "[2/2]"]
