"""Tiny networks with random weights through transformers' own processors, models and post-processing."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc_networks.sam.inference import as_phrase, ground, masks_in_boxes, segment_concepts
from torc_networks.sam.network import Runtime

WHAT = "the red box"


@pytest.mark.long
def test_boxes_and_scores_of_one_phrase_are_those_of_the_processors_post_processing(dino, rgb, torch):
    found = ground(rgb, [WHAT], dino)
    given = dino.processor(images=rgb, text=f"{WHAT}.", return_tensors="pt")
    with torch.inference_mode():
        out = dino.model(**given)
    (wanted,) = dino.processor.post_process_grounded_object_detection(
        out, given["input_ids"], threshold=0.0, target_sizes=[rgb.shape[:2]]
    )
    corners = np.clip(wanted["boxes"].numpy(), 0, [128, 96, 128, 96])
    assert len(found.corners) == len(corners) == 20
    assert np.allclose(found.corners, corners, atol=1e-3)
    assert np.allclose(found.scores[:, 0], wanted["scores"].numpy(), atol=1e-6)


def test_of_two_phrases_each_has_the_score_of_its_own_words(dino, rgb, torch):
    found = ground(rgb, ["object", WHAT], dino)
    given = dino.processor(images=rgb, text=f"object. {WHAT}.", return_tensors="pt")
    tokens = dino.processor.tokenizer.convert_ids_to_tokens(given["input_ids"][0].tolist())
    assert tokens == ["[CLS]", "object", ".", "the", "red", "box", ".", "[SEP]"]
    with torch.inference_mode():
        p = dino.model(**given).logits[0].sigmoid().numpy()
    assert np.allclose(found.scores[:, 0], p[:, 1], atol=1e-6)
    assert np.allclose(found.scores[:, 1], p[:, 3:6].max(axis=1), atol=1e-6)


def test_words_that_the_network_does_not_know_are_words_all_the_same(dino, rgb):
    assert ground(rgb, ["object", "zebra"], dino).scores.shape == (20, 2)


def test_phrases_are_small_letters_without_what_ends_a_phrase():
    assert as_phrase(" The RED box.  Is it? ") == "the red box is it"
    assert as_phrase(" .? ") == ""


def test_too_many_words_are_refused(dino, sam3, rgb):
    with pytest.raises(InputError, match="256 tokens"):
        ground(rgb, ["red box " * 200], dino)
    with pytest.raises(InputError, match="32 tokens"):
        segment_concepts(rgb, ["a long description of a box " * 2], [0.1], sam3)


def test_boxes_without_extent_or_with_nan_are_none(dino, rgb, monkeypatch):
    def broken(**given):
        out = forward(**given)
        out.pred_boxes[0, 0] = float("nan")
        out.pred_boxes[0, 1, 2] = 0.0
        out.logits[0, 2, 1] = float("nan")
        out.pred_boxes[0, 3] = 5.0  # beside the picture
        return out

    forward = dino.model.forward
    whole = ground(rgb, [WHAT], dino)
    monkeypatch.setattr(dino.model, "forward", broken)
    found = ground(rgb, [WHAT], dino)
    assert np.array_equal(found.corners, whole.corners[4:])
    assert np.array_equal(found.scores, whole.scores[4:])


@pytest.mark.parametrize("count", [1, 33, 200])
def test_masks_of_many_boxes_are_those_of_each_box_and_of_transformers(sam2, rgb, rng, torch, count):
    first = rng.uniform(0, 60, (count, 2))
    corners = np.hstack([first, first + rng.uniform(5, 36, (count, 2))]).astype(np.float32)
    found = masks_in_boxes(rgb, corners, sam2)
    masks, expected = found.masks, found.scores
    assert masks.shape == (count, 96, 128)
    assert np.isfinite(expected).all()
    for k in {0, count - 1}:
        given = sam2.processor(images=rgb, input_boxes=[[corners[k].tolist()]], return_tensors="pt")
        with torch.inference_mode():
            out = sam2.model(**given, multimask_output=False)
        (wanted,) = sam2.processor.post_process_masks(out.pred_masks, given["original_sizes"])
        assert np.mean(masks[k] != wanted[0, 0].numpy()) < 0.001
        assert expected[k] == pytest.approx(float(out.iou_scores[0, 0, 0]), abs=1e-4)
    assert len({m.tobytes() for m in masks[:5]}) == min(count, 5)


def test_no_boxes_are_no_masks(sam2, rgb):
    found = masks_in_boxes(rgb, np.zeros((0, 4), np.float32), sam2)
    assert found.masks.shape == (0, 96, 128)
    assert found.scores.shape == (0,)


def test_sam3_encodes_a_picture_once_and_says_what_two_calls_say(sam3, rgb, torch, monkeypatch):
    calls = []
    encode = sam3.model.vision_encoder.forward

    def counting(*args, **kwargs):
        calls.append(1)
        return encode(*args, **kwargs)

    monkeypatch.setattr(sam3.model.vision_encoder, "forward", counting)
    found = segment_concepts(rgb, ["object", "red box"], [0.1, 0.2], sam3)
    assert len(calls) == 1
    for words, threshold, part in zip(("object", "red box"), (0.1, 0.2), found, strict=True):
        given = sam3.processor(images=rgb, text=words, return_tensors="pt")
        with torch.inference_mode():
            out = sam3.model(**{k: v for k, v in given.items() if k != "original_sizes"})
        (wanted,) = sam3.processor.post_process_instance_segmentation(
            out, threshold=threshold, target_sizes=[rgb.shape[:2]]
        )
        assert len(part.scores) > 0
        assert np.allclose(part.scores, wanted["scores"].numpy(), atol=1e-6)
        assert np.mean(part.masks != wanted["masks"].numpy().astype(bool)) < 0.001


def test_sam3_without_presence_finds_nothing(sam3, rgb, monkeypatch):
    def absent(**given):
        out = forward(**given)
        out.presence_logits[:] = -20.0
        return out

    forward = sam3.model.forward
    monkeypatch.setattr(sam3.model, "forward", absent)
    (found,) = segment_concepts(rgb, ["object"], [0.1], sam3)
    assert found.masks.shape == (0, 96, 128)
    assert found.scores.shape == (0,)


def test_threads_are_as_set_while_a_network_runs_and_restored_after(dino, torch):
    before = torch.get_num_threads()
    network = replace(dino, runtime=Runtime(threads=before + 1))
    with contextlib.suppress(KeyError), network.running():
        seen = torch.get_num_threads(), torch.is_inference_mode_enabled()
        raise KeyError
    assert seen == (before + 1, True)
    assert torch.get_num_threads() == before
    assert not torch.is_inference_mode_enabled()
