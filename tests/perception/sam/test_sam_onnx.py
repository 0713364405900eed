"""SAM 2.1 as ONNX files: torc's own masks, redrawn where both agree. Only the comparison needs torch."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.tiny_sam_onnx import ONNX
from torc.errors import InputError
from torc.perception.embedded.perception import EmbeddedPerception
from torc.perception.protocol import Wanted
from torc.perception.sam import refining
from torc.perception.sam.network import SAM2, Runtime, load_network
from torc.perception.sam.onnx_files import DECODER, ENCODER, load_sam2_onnx, masks_in_boxes, picture_input
from torc.perception.sam.refining import Sam2OnnxConfig, Sam2OnnxPerception, agreeing, boxes_around
from torc.perception.scoring import score_masks
from torc.pipeline.building import make_stage
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import synthetic_observation

SHAPES = (box(1, 0.60, -0.20, (0.06, 0.06, 0.10)), box(2, 0.62, 0.00, (0.05, 0.08, 0.08)))
FOLDER = str(ONNX)


@pytest.fixture
def network():
    return load_sam2_onnx(FOLDER, 1)


def some_boxes(rng, count):
    first = rng.uniform(0, 60, (count, 2))
    return np.hstack([first, first + rng.uniform(5, 36, (count, 2))]).astype(np.float32)


def seen():
    return replace(synthetic_observation(SHAPES), label_image=None)


def drawing(monkeypatch, draw):
    """SAM 2.1 draws masks by a function of the boxes and the picture's shape."""

    def fake(rgb, corners, network):
        return np.array([draw(c, rgb.shape[:2]) for c in corners], bool), np.ones(len(corners), np.float32)

    monkeypatch.setattr(refining, "masks_in_boxes", fake)


def whole_box(corners, shape):
    left, top, right, bottom = corners.astype(int)
    out = np.zeros(shape, bool)
    out[top:bottom, left:right] = True
    return out


@pytest.mark.parametrize("count", [0, 1, 33, 200])
def test_any_number_of_boxes_makes_as_many_masks(network, rng, count):
    rgb = rng.integers(0, 256, (75, 101, 3), np.uint8)
    corners = some_boxes(rng, count)
    masks, expected = masks_in_boxes(rgb, corners, network)
    assert masks.shape == (count, 75, 101)
    assert expected.shape == (count,)
    if count:
        alone, _ = masks_in_boxes(rgb, corners[-1:], network)
        assert np.mean(alone[0] != masks[-1]) < 0.001


@pytest.mark.parametrize("shape", [(96, 128), (480, 640), (33, 200), (128, 128)])
def test_it_says_what_transformers_says(network, tiny, torch, rng, shape):
    corners = some_boxes(rng, 3) * np.array([shape[1] / 128, shape[0] / 96] * 2, np.float32)
    rgb = np.kron(
        rng.integers(0, 256, (shape[0] // 8 + 1, shape[1] // 8 + 1, 3), np.uint8), np.ones((8, 8, 1))
    )
    rgb = np.ascontiguousarray(rgb[: shape[0], : shape[1]].astype(np.uint8))
    by_torch = load_network(SAM2, tiny("sam2"), Runtime())
    given = by_torch.processor(images=rgb, input_boxes=[corners.tolist()], return_tensors="pt")
    assert np.abs(picture_input(rgb, 128) - given["pixel_values"].numpy()).max() < 0.03
    with torch.inference_mode():
        out = by_torch.model(**given, multimask_output=False)
    (wanted,) = by_torch.processor.post_process_masks(out.pred_masks, given["original_sizes"])
    masks, expected = masks_in_boxes(rgb, corners, network)
    assert 0.01 < masks.mean() < 0.99
    assert np.mean(masks != wanted[:, 0].numpy()) < 0.005
    assert expected == pytest.approx(out.iou_scores[0, :, 0].numpy(), abs=1e-3)


def test_it_keeps_the_rules_of_perceptions():
    check_perception(lambda: Sam2OnnxPerception(Sam2OnnxConfig(folder=FOLDER)))


def test_masks_that_do_not_agree_with_torcs_own_are_not_believed(monkeypatch):
    own, sureness = EmbeddedPerception().masks(seen())
    drawing(monkeypatch, lambda corners, shape: np.ones(shape, bool))
    label, sure = Sam2OnnxPerception(Sam2OnnxConfig(folder=FOLDER)).masks(seen())
    assert own.max() == 1
    assert score_masks(label, own).overlap_f == 1
    assert sorted(sure) == sorted(sureness)


def test_masks_that_agree_are_redrawn(monkeypatch):
    own, _ = EmbeddedPerception().masks(seen())
    drawing(monkeypatch, whole_box)
    label, _ = Sam2OnnxPerception(Sam2OnnxConfig(folder=FOLDER, rim_px=0, agree=0.3)).masks(seen())
    for k in range(2):
        rows, cols = np.nonzero(own == k)
        found = label[rows.min() : rows.max() + 1, cols.min() : cols.max() + 1]
        assert (found >= 0).all()
        assert (label[own == k] >= 0).all()


def test_two_masks_that_are_redrawn_as_one_become_one(monkeypatch):
    """What torc's own network splits, SAM 2.1 may see whole."""
    whole = EmbeddedPerception().masks(seen())[0] == 0
    rows = np.arange(whole.shape[0])[:, None]
    cut = np.median(np.nonzero(whole)[0])
    halves = np.where(whole, (rows > cut).astype(np.int16), np.int16(-1))
    monkeypatch.setattr(
        EmbeddedPerception, "masks", lambda self, o: (halves, np.array([0.6, 0.7], np.float32))
    )
    drawing(monkeypatch, lambda corners, shape: whole)
    label, sure = Sam2OnnxPerception(Sam2OnnxConfig(folder=FOLDER, agree=0.4)).masks(seen())
    assert np.array_equal(label == 0, whole)
    assert sure == pytest.approx([0.7])


def test_the_target_is_known_as_in_embedded(monkeypatch):
    eyes = Sam2OnnxPerception(Sam2OnnxConfig(folder=FOLDER))
    rows, cols = np.nonzero(synthetic_observation(SHAPES).label_image == 2)
    scene = eyes.perceive(seen(), Wanted("", mark=(int(np.median(cols)), int(np.median(rows)))), None)
    assert scene.target_id is not None
    assert eyes.needs_pictures


def test_an_empty_table_is_an_empty_scene():
    observation = replace(synthetic_observation(()), label_image=None)
    scene = Sam2OnnxPerception(Sam2OnnxConfig(folder=FOLDER)).perceive(observation, Wanted(""), None)
    assert scene.objects == ()


def test_boxes_surround_their_masks_within_the_picture():
    masks = np.zeros((2, 20, 30), bool)
    masks[0, 3:7, 10:15] = True
    masks[1, 0, 29] = True
    assert boxes_around(masks, 2).tolist() == [[8, 1, 17, 9], [27, 0, 30, 3]]
    assert boxes_around(masks, 0).tolist() == [[10, 3, 15, 7], [29, 0, 30, 1]]


def test_agreement_is_intersection_over_union():
    a = np.zeros((3, 4, 4), bool)
    b = a.copy()
    a[0, :2], b[0, 1:3] = True, True  # 4 of 12
    a[1, 0], b[1, 0] = True, True
    assert agreeing(a, b, 1 / 3).tolist() == [True, True, False]
    assert agreeing(a, b, 0.34).tolist() == [False, True, False]
    assert agreeing(a, b, 0.0).tolist() == [True, True, False]


def test_files_that_are_not_there_or_are_others_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"needs SAM 2\.1 .*tools\.sam2_onnx"):
        load_sam2_onnx("", 1)
    with pytest.raises(InputError, match=f"no file .*{ENCODER}"):
        load_sam2_onnx(str(tmp_path), 1)
    for name, other in ((ENCODER, DECODER), (DECODER, ENCODER)):
        (tmp_path / name).write_bytes((ONNX / other).read_bytes())
    with pytest.raises(InputError, match="another network"):
        load_sam2_onnx(str(tmp_path), 1)
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / ENCODER).write_bytes((ONNX / ENCODER).read_bytes()[:1000])
    with pytest.raises(InputError, match="onnxruntime reads"):
        load_sam2_onnx(str(broken), 1)
    with pytest.raises(InputError, match="agree"):
        Sam2OnnxConfig(agree=2)


def test_the_stage_is_made_by_its_name_and_asks_for_its_files():
    spec = PipelineSpec(perception="sam2-onnx", settings={"perception.folder": FOLDER})
    part = make_stage(spec, "perception", rough=True)
    assert isinstance(part, Sam2OnnxPerception)
    assert part.config.clouds.edge_slope == 4.0
    with pytest.raises(InputError, match=r"--perception\.folder"):
        make_stage(PipelineSpec(perception="sam2-onnx"), "perception").perceive(seen(), Wanted(""), None)


def test_it_runs_without_torch():
    script = f"""
import sys
sys.modules.update(torch=None, transformers=None, torchvision=None)
import numpy as np
from torc.perception.sam.onnx_files import load_sam2_onnx, masks_in_boxes
from torc.perception.sam.refining import Sam2OnnxPerception
boxes = np.array([[1, 2, 30, 40]], np.float32)
print(masks_in_boxes(np.zeros((50, 60, 3), np.uint8), boxes, load_sam2_onnx({FOLDER!r}, 1))[0].shape)
"""
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "(1, 50, 60)"
