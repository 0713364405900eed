"""Trials on a real robot in the report: beside simulated ones and the paper's, and what they can tell apart."""

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.fake_bench import made_up_table
from torc.benchmark.intervals import sign_flip_p
from torc.benchmark.paper import METHODS, REAL_METHODS, REAL_TRIALS, paper_method
from torc.benchmark.reading import read_table
from torc.benchmark.report.writing import write_report
from torc.benchmark.rows import REAL, Table, read_rows, write_tables
from torc_lab.bench.report import (
    least_p,
    real_sections,
    scenes_needed,
    separable,
    side_by_side,
    successes_apart,
)


@pytest.fixture
def both():
    """Three scenes, three times, on the robot; two problems in simulation."""
    # 15 picks are the budget: a failure.
    real = made_up_table(
        drops=["random"], **{"random": [[3, 4, 15], [5, 5, 5], [2, 2, 2]], "dg-select": [[2, 2, 2]] * 3}
    )
    beside = tuple(
        replace(r, category=REAL, problem=f"scene-{r.problem}", directory=Path(f"x/real-{r.directory.name}"))
        for r in real.rows
    )
    simulated = made_up_table(**{"random": [[3, 15]], "dg-select": [[2, 3]]})
    return replace(simulated, beside=beside)


def test_the_table_has_what_is_counted_by_hand(both):
    rows = {(row[0], row[1]): row[2:] for row in side_by_side(both, both.on_robot).rows}
    scenes, trials, got, clean, picks, drops = rows["random", "real robot"]
    assert (scenes, trials) == ("3", "9")
    assert got.startswith("8 of 9: 0.89 [")
    assert clean.startswith("0 of 9: 0.00 [")
    assert picks.startswith("4.8 [")  # (3 + 4 + 15 + 15 + 6) / 9
    assert drops.startswith("1.00 [")
    assert rows["random", "simulation"][:2] == ("1", "2")
    assert rows["random", "simulation"][2].startswith("1 of 2: 0.50 [")
    assert rows["dg-select", "the paper's robot"] == ("3", "9", "9 of 9: 1.00", "8 of 9: 0.89", "", "")
    assert rows["vlm-select", "the paper's robot"][2:4] == ("8 of 9: 0.89", "6 of 9: 0.67")
    assert [key for key in rows if key[0] == "vlm-grasps"] == [
        ("vlm-grasps", "the paper's robot"),
        ("vlm-grasps", "the paper's simulation"),
    ]
    assert ("random", "the paper's robot") not in rows  # it was not played there
    assert rows["dg-select", "the paper's simulation"][2] == "0.84"


def test_the_papers_trials_on_the_robot_are_whole_numbers():
    for method in REAL_METHODS.values():
        for share in (method.success, method.drop_free):
            assert share * REAL_TRIALS == pytest.approx(round(share * REAL_TRIALS))
        assert method.drop_free <= method.success
    assert paper_method("vlm-select[gemini-x]", real=True) is REAL_METHODS["vlm-select"]
    assert paper_method("random", real=True) is None
    assert paper_method("random") is METHODS["random"]


@pytest.mark.parametrize("scenes", range(1, 9))
def test_no_differences_have_a_lower_p_than_is_said(scenes, rng):
    extreme = min(
        sign_flip_p(np.array(signs) * rng.uniform(1, 9)) for signs in product((1, -1), repeat=scenes)
    )
    assert extreme == pytest.approx(least_p(scenes, 1))
    assert least_p(scenes, 3) == pytest.approx(min(1.0, 3 * extreme))


def test_so_many_scenes_are_needed_and_so_many_failures():
    assert [scenes_needed(pairs) for pairs in (1, 3, 10)] == [6, 7, 9]
    assert [successes_apart(n) for n in (1, 3, 4, 9)] == [None, None, 0, 4]


def test_it_is_said_that_three_scenes_tell_nothing_apart(both):
    told = " ".join(separable(both.on_robot))
    assert "3 scenes, 1 pair" in told
    assert "cannot give a p below 0.25" in told
    assert "At least 6 scenes" in told
    assert "from 9 of 9 against 4 of 9" in told
    alone = replace(both, beside=tuple(r for r in both.beside if r.planner == "random"))
    assert separable(alone.on_robot) == ["There is only one planner on the robot: nothing to tell apart."]
    assert real_sections(replace(both, beside=())) == []


def test_real_and_simulated_trials_are_kept_apart_and_both_are_in_the_tables(both, tmp_path):
    write_tables(replace(both, root=Path("x")), tmp_path)
    again = read_table(tmp_path)
    assert len(again.rows) == len(both.rows)
    assert len(again.beside) == len(both.beside) == 18
    assert {r.real for r in again.rows} == {False}
    assert {r.category for r in read_rows(tmp_path)} == {REAL, "unstructured"}


def test_a_page_of_real_trials_alone_has_the_papers_figures_of_its_robot(both, tmp_path):
    pytest.importorskip("matplotlib")
    real = Table(Path("x"), both.beside)
    tables = tmp_path / "tables"
    tables.mkdir()
    write_tables(real, tables)
    page = write_report([tables], tmp_path / "report", 0).page
    text = page.read_text()
    assert "figure 11, left" in text
    assert "figure 9, left" not in text
    assert "the paper&#x27;s robot" in text
    assert (tmp_path / "report" / "report.md").read_text().count("cannot give a p below 0.25") == 1


def test_how_scenes_were_accepted_is_counted(both, tmp_path):
    rows = []
    for i, row in enumerate(both.beside):
        directory = tmp_path / str(i)
        directory.mkdir()
        layout = {"accepted_by": "word" if i < 5 else "overlap"}
        (directory / "result.json").write_text(json.dumps({"layout": layout}))
        rows.append(replace(row, directory=directory))
    first, second = real_sections(replace(both, root=tmp_path, beside=tuple(rows)))
    assert second.blocks[0].rows[0][0] == "dg-select - random"
    assert (
        first.blocks[-1]
        == "Laid out by the overlap of every object: 13 of 18 trials; by the operator's word: 5."
    )
