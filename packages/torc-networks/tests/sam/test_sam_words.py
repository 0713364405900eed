"""What follows a network that reads words, with true masks in place of the network's: objects, ids, the target."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.from_masks import by_words
from torc.perception.protocol import Wanted
from torc.perception.target import Certainty
from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT
from torc.testing.contexts import box
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import synthetic_capture
from torc_networks.proposals import Proposals
from torc_networks.sam.perception import GroundedSam2Config, Sam3Config, WordsConfig, WordsPerception

A = box(1, 0.60, -0.20, (0.06, 0.06, 0.10))
B = box(2, 0.62, 0.00, (0.05, 0.08, 0.08))
C = box(3, 0.75, -0.10, (0.06, 0.06, 0.16))
WORDS = Wanted("the red box")


class Knowing(WordsPerception):
    """Proposes the true masks, the table's and the whole picture; `wanted` has scores by the objects' labels."""

    def __init__(self, truth, wanted=None, config=None):
        super().__init__(config or WordsConfig())
        self.truth, self.wanted, self.asked = truth, wanted or {}, []

    def propose(self, rgb, description):
        self.asked.append(description)
        labels = [k for k in np.unique(self.truth) if k >= 0]
        masks = [self.truth == k for k in labels]
        masks += [self.truth == BACKGROUND, np.ones(self.truth.shape, bool)]
        scores = [0.9 - 0.01 * i for i in range(len(masks))]
        p = [self.wanted.get(k, 0.0) if description else 0.0 for k in labels]
        return Proposals(np.array(masks), np.array(scores, np.float32), np.array([*p, 0, 0], np.float32))


def seen(shapes):
    """What a camera sees, and the labels that it does not know."""
    capture = synthetic_capture(shapes)
    return capture.observation, capture.label_image


def look(shapes, wanted, scores=None, before=None, config=None):
    observation, truth = seen(shapes)
    return Knowing(truth, scores, config).perceive(observation, wanted, before)


def true_id(scene, object_id, truth):
    """The label that an object's pixels have in truth."""
    return int(np.bincount(truth[scene.label_image == object_id]).argmax())


def test_the_objects_are_what_stands_on_the_table_and_nothing_else():
    observation, truth = seen((A, B, C))
    scene = Knowing(truth).perceive(observation, Wanted(""), None)
    assert len(scene.objects) == 3
    assert np.array_equal(scene.label_image >= 0, truth >= 0)
    assert scene.target_id is None


@pytest.mark.parametrize(
    "arm",
    [box(9, 0.5, 0.6, (0.2, 0.06, 0.2)), box(9, 0.15, -0.25, (0.1, 0.2, 0.22))],
    ids=["beside", "close"],
)
def test_what_is_beside_the_workspace_or_between_it_and_the_camera_is_no_object(arm):
    observation, truth = seen((A, arm))
    assert (truth == 9).sum() > 1000
    assert (truth == 1).sum() > 1000
    scene = Knowing(truth).perceive(observation, Wanted(""), None)
    assert [true_id(scene, k, truth) for k in scene.ids] == [1]
    assert ROBOT not in scene.label_image


def test_the_target_is_what_words_are_sure_of():
    observation, truth = seen((A, B, C))
    scene = Knowing(truth, {2: 0.6, 3: 0.2}).perceive(observation, WORDS, None)
    assert true_id(scene, scene.target_id, truth) == 2


@pytest.mark.parametrize("scores", [{}, {2: 0.3}, {2: 0.5, 3: 0.48}])
def test_not_in_sight_is_an_answer_for_what_is_unsure_or_looks_like_another(scores):
    assert look((A, B, C), WORDS, scores).target_id is None


def test_the_target_stays_the_target_while_it_stands_where_it_stood_though_words_no_longer_find_it():
    first = look((A, B, C), WORDS, {2: 0.6})
    observation, truth = seen((B, C))
    second = Knowing(truth, {2: 0.1}).perceive(observation, WORDS, first)
    assert true_id(second, second.target_id, truth) == 2
    # Unless another one is clearly surer.
    third = Knowing(truth, {3: 0.6}).perceive(observation, WORDS, second)
    assert true_id(third, third.target_id, truth) == 3


def test_ids_stay_though_masks_come_in_another_order():
    first = look((A, B, C), WORDS)
    second = look((C, A), WORDS, before=first)
    places = {o.id: o.points.mean(axis=0) for o in first.objects}
    assert len(second.objects) == 2
    for o in second.objects:
        assert np.linalg.norm(places[o.id] - o.points.mean(axis=0)) < 0.02


def test_a_mark_counts_more_than_words_which_are_not_asked_then():
    observation, truth = seen((A, B, C))
    rows, cols = np.nonzero(truth == 3)
    mark = (int(np.median(cols)), int(np.median(rows)))
    eyes = Knowing(truth, {2: 0.9})
    scene = eyes.perceive(observation, Wanted("the red box", mark=mark), None)
    assert true_id(scene, scene.target_id, truth) == 3
    again = eyes.perceive(observation, Wanted("the red box", mark=mark), scene)
    assert true_id(again, again.target_id, truth) == 3
    assert eyes.asked == ["", ""]


def test_a_mark_holds_for_the_first_picture_alone():
    observation, truth = seen((A, C))
    rows, cols = np.nonzero(truth == 3)
    mark = (int(np.median(cols)), int(np.median(rows)))
    first = Knowing(truth).perceive(observation, Wanted("", mark=mark), None)
    # Where it stood something else shows now.
    observation, truth = seen((A, box(4, 0.90, -0.10, (0.05, 0.40, 0.30))))
    assert truth[mark[1], mark[0]] == 4
    second = Knowing(truth).perceive(observation, Wanted("", mark=mark), first)
    assert first.target_id is not None
    assert second.target_id is None


def test_reference_pictures_count_more_than_words():
    observation, truth = seen((A, B, C))
    rows, cols = np.nonzero(truth == 1)
    cut = slice(rows.min(), rows.max() + 1), slice(cols.min(), cols.max() + 1)
    picture = np.dstack([observation.rgb[cut], 255 * (truth[cut] == 1).astype(np.uint8)])
    eyes = Knowing(truth, {2: 0.9}, WordsConfig(target=replace(WordsConfig().target, ahead=0.0)))
    scene = eyes.perceive(observation, Wanted("the red box", (picture,)), None)
    assert eyes.asked == [""]
    assert true_id(scene, scene.target_id, truth) == 1


@pytest.mark.parametrize("words", ["", "  ", " . "])
def test_without_words_nothing_is_the_target(words):
    config = WordsConfig(words=Certainty(0.0, 0.0, 0.0))
    scene = look((A, B), Wanted(words), {1: 0.9, 2: 0.9}, config=config)
    assert scene.target_id is None


def test_a_camera_that_hangs_upside_down_sees_the_same_scene():
    observation, truth = seen((A, B, C))
    h, w = truth.shape
    K, T = observation.K.copy(), observation.T_world_camera.copy()
    K[0, 2], K[1, 2] = w - 1 - K[0, 2], h - 1 - K[1, 2]
    T[:3, :3] = T[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    flipped = replace(
        observation,
        rgb=np.ascontiguousarray(observation.rgb[::-1, ::-1]),
        depth_m=np.ascontiguousarray(observation.depth_m[::-1, ::-1]),
        K=K,
        T_world_camera=T,
    )

    class Upright(Knowing):
        def propose(self, rgb, description):
            assert np.array_equal(rgb, observation.rgb)
            return super().propose(rgb, description)

    scene = Upright(truth, {2: 0.8}).perceive(flipped, WORDS, None)
    upright = Knowing(truth, {2: 0.8}).perceive(observation, WORDS, None)
    assert np.array_equal(scene.label_image[::-1, ::-1], upright.label_image)


def test_two_hundred_objects_are_sixty_three_at_most():
    shapes = tuple(
        box(1 + i % 60, 0.45 + 0.04 * (i // 14), -0.55 + 0.066 * (i % 14), (0.025, 0.035, 0.05))
        for i in range(196)
    )
    observation, truth = seen(shapes)
    rows, cols = np.indices(truth.shape)

    class Pieces(Knowing):
        """Many small masks."""

        def propose(self, rgb, description):
            tiles = np.where(truth >= 0, (rows // 16) * 40 + cols // 16, -1)
            names = [k for k in np.unique(tiles) if k >= 0][:200]
            masks = np.array([tiles == k for k in names])
            assert len(masks) == 200
            return Proposals(masks, np.full(200, 0.5, np.float32), np.zeros(200, np.float32))

    scene = Pieces(truth).perceive(observation, WORDS, None)
    assert 30 < len(scene.objects) < MAX_OBJECTS


def test_it_keeps_the_rules_of_perceptions():
    class Truthful(Knowing):
        """With the truth of the conformance suite's snapshots, which it asks for."""

        needs_labels = True

        def __init__(self):
            super().__init__(np.zeros((1, 1), np.int16), {0: 0.9})

        def perceive(self, observation, wanted, before, label_image):
            self.truth = label_image
            return super().perceive(observation, wanted, before)

    check_perception(Truthful)


def test_how_surely_a_mask_is_the_target_is_the_mean_over_its_pixels():
    label = np.array([[0, 0, 1, -1], [0, 0, 1, -1]], np.int16)
    p = np.array([[1, 1, 0.5, 1], [0, 0, 0.5, 1]], np.float32)
    assert by_words(label, p, [1, 0]) == pytest.approx([0.5, 0.5])
    assert by_words(label, p, []).shape == (0,)
    assert by_words(np.full((2, 2), -1, np.int16), np.ones((2, 2), np.float32), []).shape == (0,)


@pytest.mark.parametrize("config", [GroundedSam2Config, Sam3Config])
def test_settings_that_mean_nothing_are_refused(config):
    for settings in ({"object_word": " ."}, {"object_score": 2.0}, {"most": 0}, {"threads": 0}):
        with pytest.raises(InputError):
            config(**settings)
    with pytest.raises(InputError, match="cuda"):
        config(half=True)
    with pytest.raises(InputError, match="cpu or cuda"):
        config(device="tpu")
    assert config(half=True, device="cuda").half
    with pytest.raises(InputError, match="Certainty"):
        Certainty(sure=0.2, still=0.5)
