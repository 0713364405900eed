"""Pairs: only where an expert and another planner met the same look and chose differently."""

from test_finetuning import read, rows_of

from torc.exports.exporting import ExportSpec, export_trials


def test_pairs_are_of_the_same_look_and_differ(trials, tmp_path):
    export_trials(trials, tmp_path / "out", ExportSpec("pairs"))
    (row,) = rows_of(tmp_path / "out")
    # Of "lost" the choice was the oracle's; of "wild" the first two named nothing in the picture, and the third came
    # after other picks. Later looks of "random" are of other states.
    who = row["problem"], row["pick"], row["chosen_by"], row["rejected_by"]
    assert who == ("boxes", 0, "oracle", "random")
    assert (read(row["chosen"]), read(row["rejected"])) == (1, 2) == (row["chosen_id"], row["rejected_id"])
    picture = tmp_path / "out" / row["split"] / row["file_name"]
    for planner in ("oracle", "random"):
        assert picture.read_bytes() == (trials / "boxes" / planner / "picks" / "00_seen.png").read_bytes()
