"""Rows on disk, and what may not be published."""

import json
from dataclasses import replace

import datasets
import pytest

from next_object_helpers.tiny_next_object import tiny_rows
from torc.cli.main import main as run_main
from torc.errors import InputError
from torc_next_object.data.checking import blind_scores, check_directory, leaks, set_faults
from torc_next_object.data.opening import open_rows
from torc_next_object.data.publishing import REFERENCE, publish
from torc_next_object.data.tables import read_rows, write_rows, write_splits
from torc_next_object.replies import read_number
from torc_next_object.schema import row_faults
from torc_next_object.scoring import score_answers

ROWS = tiny_rows(20) + [
    replace(row, id=row.id[::-1], scene=row.scene[::-1], split="train") for row in tiny_rows(6)
]


def main(arguments):
    """The exit code of a command."""
    with pytest.raises(SystemExit) as stopped:
        run_main(arguments)
    return stopped.value.code


@pytest.fixture
def published(tmp_path):
    write_splits(tmp_path / "set", ROWS)
    publish(tmp_path / "set", ROWS)
    return tmp_path / "set"


def test_rows_come_back_as_they_were(tmp_path):
    write_rows(tmp_path / "some.parquet", ROWS)
    assert read_rows(tmp_path / "some.parquet") == ROWS


def test_a_published_set_has_no_faults_and_is_loaded_by_datasets(published, tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HOME", str(tmp_path / "hf"))
    rows, faults = check_directory(published)
    assert faults == []
    loaded = datasets.load_dataset(str(published), cache_dir=str(tmp_path / "cache"))
    assert {split: len(some) for split, some in loaded.items()} == {"train": 6, "test": 20}
    one = loaded["test"][0]
    wanted = next(row for row in rows if row.id == one["id"])
    assert isinstance(loaded["test"].features["image"], datasets.Image)
    assert one["image"].size == (32, 24)
    assert (tuple(one["numbers"]), tuple(one["values"])) == (wanted.numbers, wanted.values)


def test_the_split_that_is_asked_for_is_opened(published):
    assert {row["split"] for row in open_rows(published)} == {"test"}
    assert len(open_rows(published, "train")) == 6
    with pytest.raises(InputError, match="'hidden'"):
        open_rows(published, "hidden")


def test_the_reference_replies_have_the_scores_beside_them(published):
    told = json.loads((published / REFERENCE).read_text())
    named = {row["id"]: read_number(told["replies"][row["id"]], row["numbers"]) for row in told["rows"]}
    assert named == told["numbers"]
    assert score_answers((row, named[row["id"]]) for row in told["rows"]).to_dict() == told["scores"]
    assert None in named.values()
    assert len(set(named.values())) > 2


@pytest.mark.parametrize(
    "change",
    [
        {"numbers": (9, 8, 3, 0)},
        {"values": (1.0, 2.0)},
        {"values": (float("nan"),) * 4},
        {"best": (9,)},
        {"random_value": 9.0},
        {"target_hidden": True},
        {"values_low": (9.0,) * 4},
        {"source": "elsewhere"},
        {"image": b"GIF89a"},
        {"relations": "[{"},
        {"relations_true": ()},
        {"relations": '[{"source": 77, "relation": "behind", "target": 3}]'},
        {"baselines": '{"random": 77}'},
    ],
    ids=lambda change: " ".join(change),
)
def test_a_row_that_is_not_consistent_is_found(change):
    row = next(row for row in ROWS if row.numbers == (0, 3, 8, 9))
    assert list(row_faults(row)) == []
    if "best" in change and row.best == (9,):
        change = {"best": (0,)}
    assert list(row_faults(replace(row, **change)))


def test_signs_that_give_the_answer_away_are_found():
    row = replace(ROWS[1], numbers=(1, 2, 3, 4), target_hidden=True, values=(1.0, 2.0, 3.0, 4.0), best=(1,))
    rigged = [replace(row, id=f"{i:024x}", picks_taken=i // 20) for i in range(60)]
    signs = leaks(rigged)
    assert signs["the size of the number"] < -4
    assert signs["the order of ids (picks taken)"] > 4
    assert any("size of the number" in fault for fault in set_faults(rigged))


def test_ids_twice_and_problems_in_two_splits_are_found():
    again = replace(ROWS[0], split="train")
    faults = list(set_faults([*ROWS, again]))
    assert any("twice" in fault for fault in faults)
    assert any("two splits" in fault for fault in faults)


def test_a_file_without_declared_features_is_no_set(tmp_path, capsys):
    import pyarrow.parquet as pq

    write_rows(tmp_path / "test.parquet", ROWS)
    table = pq.read_table(tmp_path / "test.parquet")
    pq.write_table(table.replace_schema_metadata({}), tmp_path / "test.parquet")
    assert main(["next-object", "check", str(tmp_path)]) == 1
    assert "does not declare" in capsys.readouterr().out


def test_what_cannot_be_read_is_said(tmp_path, capsys):
    (tmp_path / "broken.parquet").write_bytes(b"PAR1 no more")
    assert main(["next-object", "check", str(tmp_path)]) == 2
    assert "cannot be read" in capsys.readouterr().err
    assert main(["next-object", "check", str(tmp_path / "none")]) == 2


def test_replies_are_scored_from_the_command_line(published, tmp_path, capsys):
    test_rows = [row for row in ROWS if row.split == "test"]
    replies = tmp_path / "replies.jsonl"
    lines = [json.dumps({"id": row.id, "reply": f"Answer: {row.best[0]}"}) for row in test_rows[:-1]]
    replies.write_text("\n".join(lines))
    assert main(["next-object", "score", str(published), str(replies), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["missing"], told["rows"]) == (1, len(test_rows))
    assert told["invalid"] == pytest.approx(1 / len(test_rows), abs=1e-4)
    replies.write_text('{"id": 3')
    assert main(["next-object", "score", str(published), str(replies)]) == 2


@pytest.mark.parametrize("harness", ["lmms-eval", "vlmevalkit", "inspect"])
def test_files_for_harnesses_are_written_once(harness, published, tmp_path, capsys):
    out = tmp_path / harness
    arguments = ["next-object", "export", str(published), "--harness", harness, "--out", str(out)]
    assert main(arguments) == 0
    told = capsys.readouterr().out
    assert all(variant in told for variant in ("image", "grasps", "relations"))
    assert any(out.iterdir())
    assert main(arguments) == 2
    assert "not empty" in capsys.readouterr().err


def test_answers_without_the_picture_are_scored_and_a_rigged_set_shows():
    fair = blind_scores(tiny_rows(300))
    assert all(s["regret_low"] < 1.15 and s["regret_high"] > 0.85 for s in fair.values())
    lowest = [
        replace(
            row,
            values=tuple(1.0 + i for i in range(len(row.numbers))),
            random_value=2.0,
            best=row.numbers[:1],
        )
        for row in tiny_rows(40)
    ]
    assert blind_scores(lowest)["the lowest"]["regret"] == 0
