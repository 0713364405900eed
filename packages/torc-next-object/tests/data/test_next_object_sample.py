"""The decisions that come with torc: whole, fairly chosen, small, and read with what the program alone needs."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from next_object_sample import FILE, chosen_decisions, write_sample

from next_object_helpers.tiny_next_object import tiny_rows
from tests.helpers.vlm_server import FakeVlmServer, Say
from torc.cli.main import parse
from torc.errors import InputError
from torc.vlm.clients.api import OWN_SERVER_VARIABLE
from torc_next_object.data.opening import SAMPLE, open_rows, sample_rows
from torc_next_object.prompting import VARIANTS, prompt_text, sent_pictures

VALUES = Path(__file__).parents[4] / "results" / "next-object" / "values.jsonl"
MOST_BYTES = 6_000_000


def test_sixty_decisions_of_as_many_problems_with_their_published_values():
    rows = sample_rows()
    assert len({row["scene"] for row in rows}) == len(rows) == 60
    assert {row["split"] for row in rows} == {"test"}
    assert 24 <= sum(row["target_hidden"] for row in rows) <= 36
    assert min(Counter((row["source"], row["category"]) for row in rows).values()) >= 7
    known = [json.loads(line) for line in VALUES.read_text(encoding="utf-8").splitlines()]
    published = {entry["id"]: sorted(v[0] for v in entry["values"].values()) for entry in known}
    for row in rows:
        assert sorted(row["values"]) == published[row["id"]]
        assert all(picture.startswith(b"\xff\xd8\xff") for picture in sent_pictures(row))
        assert all(prompt_text(row, variant) for variant in VARIANTS)
    assert FILE.stat().st_size < MOST_BYTES


def test_what_is_written_is_read_and_does_not_depend_on_the_day(tmp_path):
    rows = tiny_rows()
    write_sample(rows, tmp_path / "a.zip")
    write_sample(rows[::-1], tmp_path / "b.zip")
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()


def test_families_and_targets_out_of_sight_are_chosen_evenly():
    rows = [
        replace(row, id=f"{n}{row.id}", scene=f"scene {n}")
        for n in range(30)
        for row in tiny_rows(3)  # One has its target out of sight.
    ]
    families = {f"scene {n}": "abc"[n % 3] for n in range(29)}
    chosen = chosen_decisions(rows, families, 12, 0)
    assert Counter(families[row.scene] for row in chosen) == {"a": 4, "b": 4, "c": 4}
    assert len({row.scene for row in chosen}) == 12
    assert sum(row.target_hidden for row in chosen) == 6
    assert chosen == chosen_decisions(rows[::-1], families, 12, 0) != chosen_decisions(rows, families, 12, 1)
    with pytest.raises(InputError, match="need as many problems"):
        chosen_decisions(rows, families, 30, 0)


def test_vlm_eval_runs_at_once(tmp_path, monkeypatch, capsys):
    """Without a data set, a network, or the extra that reads Parquet."""
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    monkeypatch.setenv(OWN_SERVER_VARIABLE, "key-of-torc-testing-0123456789")
    with FakeVlmServer("openai", [Say("Answer: 0")], "key-of-torc-testing-0123456789") as server:
        line = [
            "vlm-eval",
            "--vlm",
            f"openai:some-model@{server.url}",
            "--out",
            str(tmp_path / "out"),
            "--yes",
        ]
        assert parse(line).run() == 0
    printed = capsys.readouterr()
    assert "60 decisions that come with torc. They are a sample for trying things" in printed.err
    found = json.loads((tmp_path / "out" / "scores.json").read_text(encoding="utf-8"))
    assert (found["answered"], found["scores"]["rows"]) == (60, 60)
    assert found["baselines"]["dg-select"]["regret"] < 0.6 < found["baselines"]["random"]["regret"]


def test_other_splits_are_not_in_it_and_a_folder_that_is_missing_leads_to_it(tmp_path):
    with pytest.raises(InputError, match="no decisions in its split 'train'"):
        open_rows(SAMPLE, "train")
    with pytest.raises(InputError, match="'sample' names the decisions that come with torc"):
        open_rows(tmp_path / "next_object")
