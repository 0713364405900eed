"""`torc decide` for a frame without masks: the target by a mark, by pictures, by words that a model reads."""

import json
import re

import numpy as np
import pytest
from PIL import Image

from tests.helpers.fake_vlm import ScriptedVlm
from tests.helpers.torc_command import run_torc
from torc.testing.contexts import box
from torc.testing.synthetic import raycast, synthetic_observation

SHAPES = (box(3, 0.60, -0.20, (0.06, 0.06, 0.16)), box(5, 0.62, 0.00, (0.05, 0.08, 0.08)))
TRUE_LABELS = raycast(SHAPES).label_image


@pytest.fixture
def frame(tmp_path):
    o = synthetic_observation(SHAPES)
    np.savez(tmp_path / "f.npz", rgb=o.rgb, depth_m=o.depth_m, K=o.K, T_world_camera=o.T_world_camera)
    return tmp_path / "f.npz"


def middle(object_id):
    rows, cols = np.nonzero(object_id == TRUE_LABELS)
    return f"{int(np.median(cols))},{int(np.median(rows))}"


def test_a_mark_is_the_target_and_pictures_are_written(frame, tmp_path, capsys):
    options = ("--mark", middle(5), "--json", "--out", tmp_path / "answer")
    code, out, _ = run_torc("decide", frame, *options, capsys=capsys)
    answer = json.loads(out)
    assert code == 0
    assert answer["eyes"] == "embedded"
    assert answer["target_visible"]
    assert answer["label"] == answer["target"]
    assert answer["target"] in {o["label"] for o in answer["objects"]}
    assert all(0 <= o["sureness"] <= 1 for o in answer["objects"])
    assert (tmp_path / "answer" / "seen.png").is_file()


def test_torcs_own_network_is_the_default_and_says_so(frame, capsys):
    code, out, _ = run_torc("decide", frame, capsys=capsys)
    assert code == 0
    assert "found by torc (perception: embedded)" in out
    assert "The target is hidden." in out


def test_reference_pictures_are_read(frame, tmp_path, capsys):
    o = synthetic_observation(SHAPES)
    alpha = np.where(TRUE_LABELS == 3, 255, 0).astype(np.uint8)
    rows, cols = np.nonzero(alpha)
    cut = np.dstack([o.rgb, alpha])[rows.min() - 4 : rows.max() + 5, cols.min() - 4 : cols.max() + 5]
    Image.fromarray(cut).save(tmp_path / "box.png")
    code, out, _ = run_torc("decide", frame, "--reference", tmp_path / "box.png", "--json", capsys=capsys)
    answer = json.loads(out)
    assert code == 0
    assert answer["target_visible"]
    target = answer["target"]
    assert answer["label"] == target
    p = {k["label"]: k["target_p"] for k in answer["objects"]}
    assert max(p, key=p.get) == target
    assert p[target] > 0.5
    assert sum(p.values()) <= 1.001
    _, out, _ = run_torc("decide", frame, "--reference", tmp_path / "box.png", capsys=capsys)
    assert re.search(rf"The target is object {target} \(p = [01]\.\d\d\), in sight\.", " ".join(out.split()))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--mark", "3,3"), "No object was found at the mark 3,3"),
        (("--mark", "9999,3"), "off the picture"),
        (("--mark", "here"), "COLUMN,ROW"),
        (("--mark", "5,5,2,9"), "no area"),
        (("--reference", "missing.png"), "missing.png"),
        (("--mark", "320,240", "--reference", "missing.png"), "give one of them"),
        (("--depth", "tof"), "leave --depth out"),
    ],
)
def test_what_cannot_be_is_told(frame, options, told, capsys):
    code, _, err = run_torc("decide", frame, *options, capsys=capsys)
    assert code == 2
    assert told in err


def test_options_for_frames_without_masks_are_refused_with_masks(frame, tmp_path, capsys):
    o = synthetic_observation(SHAPES)
    arrays = {"rgb": o.rgb, "depth_m": o.depth_m, "K": o.K, "T_world_camera": o.T_world_camera}
    np.savez(tmp_path / "masked.npz", **arrays, labels=TRUE_LABELS, target=3)
    code, _, err = run_torc("decide", tmp_path / "masked.npz", "--mark", "5,5", capsys=capsys)
    assert code == 2
    assert "frames without masks" in err


def test_own_eyes_on_a_frame_with_masks_number_objects_themselves_and_know_its_target(tmp_path, capsys):
    o = synthetic_observation(SHAPES)
    arrays = {"rgb": o.rgb, "depth_m": o.depth_m, "K": o.K, "T_world_camera": o.T_world_camera}
    label = np.where(TRUE_LABELS == 3, 40, np.where(TRUE_LABELS == 5, 50, 0))
    np.savez(tmp_path / "masked.npz", **arrays, labels=label, target=50)
    code, out, _ = run_torc(
        "decide", tmp_path / "masked.npz", "--json", "--perception", "embedded", capsys=capsys
    )
    answer = json.loads(out)
    assert code == 0
    assert answer["target_sought_by"] == "mark"
    (target,) = (k for k in answer["objects"] if k["label"] == answer["target"])
    assert target["pixels"] == pytest.approx(np.count_nonzero(label == 50), rel=0.1)
    assert all(k["label"] < 40 for k in answer["objects"])
    assert "is_target" not in answer


def test_what_told_nothing_of_the_target_is_said(frame, tmp_path, capsys):
    _, out, _ = run_torc("decide", frame, capsys=capsys)
    assert "add --reference" in " ".join(out.split())
    Image.fromarray(np.full((60, 60, 3), (250, 20, 220), np.uint8)).save(tmp_path / "pink.png")
    _, out, _ = run_torc("decide", frame, "--reference", tmp_path / "pink.png", capsys=capsys)
    assert "No mask looks enough like the reference pictures." in " ".join(out.split())


def test_where_nothing_was_found_depth_is_told_of(frame, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("torc.perception.embedded.perception.window_on", lambda *_: None)
    code, _, err = run_torc("decide", frame, capsys=capsys)
    assert code == 2
    assert "No object was found in the picture" in err
    assert "of the pixels have a reading of depth" in err


def test_an_empty_table_is_told_of(tmp_path, capsys):
    o = synthetic_observation(())
    np.savez(tmp_path / "e.npz", rgb=o.rgb, depth_m=o.depth_m, K=o.K, T_world_camera=o.T_world_camera)
    code, _, err = run_torc("decide", tmp_path / "e.npz", capsys=capsys)
    assert code == 2
    assert "nothing stands on the support" in err


def test_words_are_read_by_a_model(frame, monkeypatch, capsys):
    client = ScriptedVlm(['{"thoughts": "the tall one", "number": 1}'])
    monkeypatch.setattr("torc.pipeline.planners.open_client", lambda *_: client)
    options = (
        "--description",
        "the tall box",
        "--vlm",
        "openai:any@http://localhost:1/v1",
        "--json",
    )
    code, out, _ = run_torc("decide", frame, *options, capsys=capsys)
    answer = json.loads(out)
    assert code == 0
    assert answer["target_visible"]
    assert "the tall box" in client.questions[0].prompt
