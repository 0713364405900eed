"""The stages `--perception grounded-sam2`, the paper's, and `--perception sam3`: objects and target by words.

The paper calls Grounding SAM 2 twice: "once with a short natural language description of the target object and then
prompted just with the word 'Object' to segment all objects". Both stages do so; ids, clouds and memory are made as in
`embedded`. A target below its threshold is not in sight.
"""

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float32, UInt8

from torc import InputError, Observation, Wanted
from torc.perception.embedded.inputs import hangs_upside_down
from torc.perception.from_masks import FromMasks, FromMasksConfig, Masks
from torc.perception.target import Certainty
from torc.workspace.description import Workspace
from torc_networks.proposals import LayoutConfig, Proposals, objects_among
from torc_networks.sam.inference import Boxes, as_phrase, ground, masks_in_boxes, segment_concepts
from torc_networks.sam.network import GROUNDING_DINO, SAM2, SAM3, Kind, Network, Runtime, load_network


@dataclass(frozen=True)
class WordsConfig(FromMasksConfig):
    """Settings that perceptions by words share.

    Attributes:
        layout: which masks are objects.
        words: lowest scores at which a mask is the target. A recognised target stays the target while it is tracked,
            unless another object is clearly surer.
        object_word: the word for any object.
        object_score: masks with a lower score are dropped.
        most: largest number of masks considered, surest first.
        device: where the networks run, cpu or cuda.
        half: use bfloat16; on cuda alone.
    """

    layout: LayoutConfig = field(default_factory=LayoutConfig)
    words: Certainty = field(default_factory=lambda: Certainty(sure=0.35, still=0.0, ahead=0.05))
    object_word: str = "object"
    object_score: float = 0.25
    most: int = 100
    device: Literal["cpu", "cuda"] = "cpu"
    half: bool = False

    def __post_init__(self) -> None:
        if not as_phrase(self.object_word):
            raise InputError("object_word is empty; 'object' is the paper's.")
        if not 0 <= self.object_score <= 1 or self.most < 1:
            raise InputError("object_score must be from 0 to 1, and most at least 1.")
        if self.device not in ("cpu", "cuda") or self.threads < 1:
            raise InputError("device must be cpu or cuda, and threads at least 1.")
        if self.half and self.device != "cuda":
            raise InputError("Half precision is for cuda alone: set device to cuda, or half to False.")


@dataclass(frozen=True)
class GroundedSam2Config(WordsConfig):
    """Settings of Grounding DINO with SAM 2.1.

    Attributes:
        detector: weights of Grounding DINO: a folder, or an id on the Hugging Face hub. The default is
            IDEA-Research/grounding-dino-tiny (Apache-2.0).
        segmenter: weights of SAM 2.1, likewise. The default is facebook/sam2.1-hiera-tiny (Apache-2.0).
        one_call: asks for both phrases in one text, "object. DESCRIPTION.", and reads the result twice. It halves the
            detector's time, but the phrases influence each other; the paper calls twice.
    """

    detector: str = "IDEA-Research/grounding-dino-tiny"
    segmenter: str = "facebook/sam2.1-hiera-tiny"
    one_call: bool = False


@dataclass(frozen=True)
class Sam3Config(WordsConfig):
    """Settings of SAM 3.

    Attributes:
        weights: a folder, or an id on the Hugging Face hub. The default is facebook/sam3 (SAM License, gated).
    """

    words: Certainty = field(default_factory=lambda: Certainty(sure=0.5, still=0.0, ahead=0.05))
    object_score: float = 0.3
    weights: str = "facebook/sam3"


class WordsPerception(FromMasks):
    """Finds any object, and the target by its description. With reference pictures or a mark in the first picture, the
    description is not read.
    """

    reads_words = True
    config: WordsConfig

    def __init__(self, config: WordsConfig, workspace: Workspace | None = None) -> None:
        super().__init__(config, workspace)
        self.words = config.words

    @abstractmethod
    def propose(self, rgb: UInt8[np.ndarray, "h w 3"], description: str) -> Proposals:
        """Return what the network finds in an upright picture; an empty description is not asked for."""

    def find(self, observation: Observation, wanted: Wanted) -> Masks:
        """Return the masks of the objects. Raises as `propose`."""
        description = "" if wanted.pictures or wanted.mark else wanted.description
        over = hangs_upside_down(observation.T_world_camera)
        rgb = observation.rgb[::-1, ::-1] if over else observation.rgb
        found = self.propose(np.ascontiguousarray(rgb), description)
        if over:
            found = Proposals(found.masks[:, ::-1, ::-1], found.scores, found.wanted_p)
        masks = objects_among(found, observation, self.workspace, self.config.clouds, self.config.layout)
        return masks if as_phrase(description) else Masks(masks.label, masks.sureness)

    def _network(self, kind: Kind, weights: str) -> Network:
        config = self.config
        return load_network(kind, weights, Runtime(config.device, config.half, config.threads))


class GroundedSam2Perception(WordsPerception):
    """The paper's perception: boxes for words by Grounding DINO, masks for boxes by SAM 2.1."""

    config: GroundedSam2Config

    def __init__(self, config: GroundedSam2Config | None = None, workspace: Workspace | None = None) -> None:
        super().__init__(GroundedSam2Config() if config is None else config, workspace)

    def propose(self, rgb: UInt8[np.ndarray, "h w 3"], description: str) -> Proposals:
        """Return a mask for each box; its score is the box's, times the overlap that SAM 2.1 expects.

        Raises as `load_network` and `ground`.
        """
        corners, scores, wanted_p = self.boxes(rgb, as_phrase(description))
        found = masks_in_boxes(rgb, corners, self._network(SAM2, self.config.segmenter))
        return Proposals(found.masks, scores * np.clip(found.scores, 0, 1), wanted_p)

    def boxes(
        self, rgb: UInt8[np.ndarray, "h w 3"], phrase: str
    ) -> tuple[Float32[np.ndarray, "n 4"], Float32[np.ndarray, "n"], Float32[np.ndarray, "n"]]:
        """Return the surest boxes: corners in pixels, scores, and how surely each shows the phrase."""
        config, anything = self.config, as_phrase(self.config.object_word)
        detector = self._network(GROUNDING_DINO, config.detector)
        if phrase and config.one_call:
            found = ground(rgb, [anything, phrase], detector)
        else:
            parts = [_in_column(ground(rgb, [anything], detector), 0)]
            if phrase:
                parts.append(_in_column(ground(rgb, [phrase], detector), 1))
            found = Boxes(np.vstack([b.corners for b in parts]), np.vstack([b.scores for b in parts]))
        scores = np.where(found.scores >= [config.object_score, config.words.sure], found.scores, 0)
        best = scores.max(axis=1)
        order = np.argsort(-best, kind="stable")[: config.most]
        order = order[best[order] > 0]
        return found.corners[order], best[order].astype(np.float32), scores[order, 1].astype(np.float32)


def _in_column(boxes: Boxes, column: int) -> Boxes:
    """Give boxes of one phrase two scores, as any object and as the target: their own, and 0."""
    scores = np.zeros((len(boxes.corners), 2), np.float32)
    scores[:, column] = boxes.scores[:, 0]
    return Boxes(boxes.corners, scores)


class Sam3Perception(WordsPerception):
    """SAM 3: masks for words, in one network; the picture is encoded once for both phrases."""

    config: Sam3Config

    def __init__(self, config: Sam3Config | None = None, workspace: Workspace | None = None) -> None:
        super().__init__(Sam3Config() if config is None else config, workspace)

    def propose(self, rgb: UInt8[np.ndarray, "h w 3"], description: str) -> Proposals:
        """Return what shows "object", and the description. Raises as `load_network` and `segment_concepts`."""
        config, description = self.config, " ".join(description.split())
        asked = [(config.object_word, config.object_score)]
        if description:
            asked.append((description, config.words.sure))
        words, thresholds = zip(*asked)
        found = segment_concepts(rgb, words, thresholds, self._network(SAM3, config.weights))
        masks = np.concatenate([f.masks for f in found])
        scores = np.concatenate([f.scores for f in found])
        wanted_p = np.concatenate([k * f.scores for k, f in enumerate(found)]).astype(np.float32)
        return Proposals(masks, scores, wanted_p)[np.argsort(-scores, kind="stable")[: config.most]]
