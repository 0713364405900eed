"""Perception by a server's masks: what it is told, what becomes of its answers, and torc's own eyes behind it."""

import numpy as np
import pytest

from torc.errors import InputError, NetworkError
from torc.perception.embedded.perception import EmbeddedPerception
from torc.perception.protocol import Wanted
from torc.perception.segmentation import REAL_CAMERA
from torc.pipeline.building import make_stage
from torc.registry.context import BuildContext
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box, small_mount
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import synthetic_capture, synthetic_observation
from torc_networks.perception import NetworkPerception, NetworkPerceptionConfig

THINGS = (
    box(0, 0.72, -0.1, (0.06, 0.06, 0.2)),
    box(1, 0.60, -0.1, (0.06, 0.08, 0.12)),
    box(2, 0.62, 0.1, (0.05, 0.05, 0.1)),
)
WANTED = Wanted("the tin")


CAPTURE = synthetic_capture(THINGS, small_mount())
TRUTH = CAPTURE.label_image
MASKS = np.stack([k == TRUTH for k in range(3)])


@pytest.fixture(scope="module")
def observation():
    return CAPTURE.observation


@pytest.fixture
def seen(server_of, observation):
    """The scene that `--perception network` makes of a server's answer."""

    def make(answer, **settings):
        stage = NetworkPerception(NetworkPerceptionConfig(server=server_of(segment=answer), **settings))
        return stage.perceive(observation, WANTED, None)

    return make


def test_right_masks_make_right_objects(seen):
    table = ~MASKS.any(axis=0)
    scene = seen({"masks": np.concatenate([MASKS, table[None]]), "scores": [0.9, 0.8, 0.7, 1.0]})
    assert len(scene.objects) == 3
    for o in scene.objects:
        truth = np.bincount(TRUTH[o.pixels[:, 0], o.pixels[:, 1]] + 1, minlength=4)
        assert truth.max() == truth.sum()
    np.testing.assert_array_equal(scene.label_image >= 0, MASKS.any(axis=0))


def test_the_answers_of_one_scene_in_every_form_are_one(seen):
    labels = np.where(MASKS.any(axis=0), TRUTH, -1).astype(np.int32)
    forms = [{"masks": MASKS}, {"masks": MASKS.astype(np.int64)}, {"labels": labels}]
    scenes = [seen({**form, "scores": [0.9, 0.8, 0.7]}) for form in forms]
    for scene in scenes[1:]:
        np.testing.assert_array_equal(scene.label_image, scenes[0].label_image)


def test_an_answer_without_objects_is_a_scene_without(seen, observation):
    for form in ({"masks": np.zeros((0, 5, 5), bool)}, {"labels": np.full(observation.depth_m.shape, -1)}):
        assert seen({**form, "scores": []}).objects == ()


def test_masks_at_twice_the_size_make_the_same_scene(seen):
    scores = [0.9, 0.8, 0.7]
    here = seen({"masks": MASKS, "scores": scores})
    there = seen({"masks": MASKS.repeat(2, axis=1).repeat(2, axis=2), "scores": scores})
    np.testing.assert_array_equal(there.label_image, here.label_image)


def test_doubtful_masks_are_left_out(seen):
    assert len(seen({"masks": MASKS, "scores": [0.9, 0.4, 0.7]}, min_score=0.5).objects) == 2


def test_the_server_is_sent_picture_depth_camera_and_words(server_of, told, observation):
    server = server_of(segment={"masks": np.zeros((0, 1, 1), bool), "scores": []})
    NetworkPerception(NetworkPerceptionConfig(server=server, prompt="a tin.")).perceive(
        observation, WANTED, None
    )
    asked = told["segment"]
    np.testing.assert_array_equal(asked["rgb"], observation.rgb)
    np.testing.assert_array_equal(asked["depth_m"], observation.depth_m * (observation.depth_m <= 10))
    np.testing.assert_array_equal(asked["T_world_camera"], observation.T_world_camera)
    np.testing.assert_array_equal(asked["K"], observation.K)
    assert asked["prompt"] == "a tin."


@pytest.mark.parametrize(
    "answer",
    [
        {"masks": np.ones((1, 240, 300), bool), "scores": [0.5]},
        {"masks": np.ones((1, 320, 240), bool), "scores": [0.5]},
        {"masks": np.ones((1, 240, 320), bool), "scores": [float("nan")]},
        {"masks": np.ones((2, 240, 320), bool), "scores": [0.5]},
        {"labels": np.zeros((2, 2), int), "scores": [0.5]},
        {"labels": np.full((240, 320), 3), "scores": [0.5]},
        {"masks": np.full((1, 240, 320), 255, np.uint8), "scores": [0.5]},
        {"error": "no GPU"},
        {},
    ],
    ids=lambda a: ", ".join(f"{k} {np.shape(v)}" for k, v in a.items()),
)
def test_nonsense_is_refused(seen, answer):
    with pytest.raises(NetworkError, match="'segment'"):
        seen(answer)


def test_more_masks_than_ids_are_the_largest_ones(seen):
    rows, cols = np.nonzero(TRUTH == 0)
    masks = np.zeros((150, *TRUTH.shape), bool)
    for k in range(150):
        masks[k, rows[k::150], cols[k::150]] = True
    seen({"masks": masks, "scores": np.full(150, 0.5)})


def test_torcs_own_eyes_behind_a_server_see_what_they_see_here(server_of, own_parts):
    pytest.importorskip("onnxruntime")
    stage = NetworkPerception(NetworkPerceptionConfig(server=server_of(segment=own_parts.segment)))
    here, there = None, None
    for shapes in (THINGS, THINGS[1:]):
        picture = synthetic_observation(shapes, small_mount())
        here, there = (
            EmbeddedPerception().perceive(picture, WANTED, here),
            stage.perceive(picture, WANTED, there),
        )
        assert there.ids == here.ids
        np.testing.assert_array_equal(there.label_image, here.label_image)
        for a, b in zip(here.objects, there.objects):
            np.testing.assert_array_equal(a.points, b.points)
    assert len(here.objects) == 2


@pytest.mark.long
def test_it_conforms(server_of, own_parts):
    pytest.importorskip("onnxruntime")
    server = server_of(segment=own_parts.segment)
    check_perception(lambda: NetworkPerception(NetworkPerceptionConfig(server=server)))


def test_it_is_made_by_name_and_settings(workspace):
    settings = {
        "perception.prompt": "tin.",
        "perception.layout.left": 0.4,
        "perception.tracking.reach_m": 0.1,
    }
    spec = PipelineSpec(perception="network", settings=settings)
    config = make_stage(spec, "perception", BuildContext(workspace=workspace)).asked
    assert (config.prompt, config.layout.left, config.tracking.reach_m) == ("tin.", 0.4, 0.1)
    assert (
        make_stage(spec, "perception", BuildContext(workspace=workspace), rough=True).asked.clouds
        == REAL_CAMERA
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {
            "rgb": np.zeros((4, 5, 3), np.uint8),
            "depth_m": np.zeros((4, 4), "f4"),
            "K": np.eye(3),
            "T_world_camera": np.eye(4),
        },
        {
            "rgb": np.zeros((4, 5, 3), np.uint8),
            "depth_m": np.zeros((4, 5), "f4"),
            "K": np.eye(2),
            "T_world_camera": np.eye(4),
        },
        {
            "rgb": np.zeros((4, 5, 3), np.uint8),
            "depth_m": np.zeros((4, 5), "f4"),
            "K": np.eye(3),
            "T_world_camera": 2 * np.eye(4),
        },
    ],
    ids=range(4),
)
def test_torcs_own_server_refuses_bad_requests(wrong, own_parts):
    with pytest.raises(InputError):
        own_parts.segment(wrong)
