"""The break-even study plays what is missing, and tells what the trials on disk tell. The trials here are made up."""

import json
import sys

import pytest

from benchmarks import vlm_break_even

PROBLEMS = ("structured-04", "unstructured-02")
OPTIONS = f"--problems {','.join(PROBLEMS)} --seeds 2 --accuracies 0.5 1 --profiles paper".split()


@pytest.fixture
def study(monkeypatch, tmp_path):
    """The study with a `play` that makes trials up: all succeed but those of a VLM that knows nothing."""

    def play(problem, planner, seed, out, vlm):
        good, lost = vlm not in ("simulated:0.5", "simulated:paper"), 2 if vlm else 0
        outcomes = ["no valid choice"] * lost + ["removed", "retrieved" if good else "missed"]
        counts = {"drops": seed, "outcomes": outcomes, "picks": len(outcomes)}
        result = {"status": "completed", "retrieved": good, **counts}
        if (problem, planner, seed) == (PROBLEMS[1], "random", 1):
            result = {"status": "errored"}
        out.mkdir()
        (out / "result.json").write_text(json.dumps(result))
        return out.name

    def run_here(work, jobs, workers):
        vlm_break_even.played = [work(*job) for job in jobs]

    monkeypatch.setattr(vlm_break_even, "play", play)
    monkeypatch.setattr(vlm_break_even, "run_jobs", run_here)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["study", "--out", str(tmp_path), *OPTIONS, *arguments])
        vlm_break_even.main()
        return vlm_break_even.played, (tmp_path / "table.md").read_text()

    return run


def _row(text, *first):
    rows = [[c.strip() for c in line[1:-1].split("|")] for line in text.splitlines() if line[:1] == "|"]
    (row,) = [r for r in rows if r[: len(first)] == list(first)]
    return row


def test_the_table_and_the_figure_of_made_up_trials(study, tmp_path, capsys):
    played, text = study()
    assert len(played) == len(set(played)) == 2 * 2 * (3 + 3 * 3)
    assert "structured-04-vlm-select-simulated-0.5-1" in played
    assert text.strip() == capsys.readouterr().out.strip()
    assert "Incomplete" not in text

    def starts(*first):
        return " ".join(cell.split(" [")[0] for cell in _row(text, *first)[2:])

    assert starts("random") == "4 1 1.00 0.67 2.0 0.33 0.00 0.00 0.0"
    assert starts("vlm-select", "simulated:1") == "4 0 1.00 0.50 4.0 0.50 0.50 0.00 2.0"
    assert starts("vlm-grasps", "simulated:0.5") == "4 0 0.00 0.00 15.0 0.50 0.50 -1.00 13.0"
    assert _row(text, "dg-select")[-1] == ""
    drawing = (tmp_path / "break_even.svg").read_text()
    assert "<svg" in drawing

    # Nothing is played twice, and the same trials give the same files.
    played, again = study()
    assert (played, again) == ([], text)
    assert (tmp_path / "break_even.svg").read_text() == drawing
