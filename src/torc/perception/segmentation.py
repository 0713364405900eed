"""Turn depth and a label image into object clouds with normals, whatever made the labels (paper: Perception)."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Int16, Int32

from torc.errors import InputError
from torc.geometry.transforms import finer, kernel_array
from torc.parallel import each, shares
from torc.perception.image_kernels import (
    count_labels,
    find_pieces,
    fit_planes,
    lift_pixels,
    looked_up,
    measure_pieces,
    normals_of_planes,
    surface_pixels,
)
from torc.perception.protocol import Wanted
from torc.records import (
    BACKGROUND,
    MAX_OBJECTS,
    ROBOT,
    TARGET_ID,
    Observation,
    SegmentedObject,
    SegmentedScene,
)
from torc.registry.kinds import PerceptionTraits
from torc.registry.settings import ConfigTraits


@dataclass(frozen=True)
class PerceptionConfig(ConfigTraits):
    """How clouds are made.

    Values in pixels are for a picture of 640 x 480; see `at`.

    Attributes:
        min_depth_m, max_depth_m: readings outside this range do not count.
        min_pixels: an object with a smaller mask is not reported.
        min_target_pixels: least mask size for the target to be reported.
        min_points: an object with fewer points is not reported: nothing can be planned on it.
        edge_slope: neighbouring pixels whose depths differ by more than this many times a pixel's width on the surface
            belong to different surfaces. 8 is a surface seen at 83 degrees; lower it for sensors that smear edges.
        normal_radius_px: normals are fitted in a window of this radius; raise it for noisy depth.
        stride: objects keep every stride-th pixel along rows and columns.
        background_stride: stride of the background.
        rim_px: background pixels this close to a reported object's mask are not background points: a mask that is a
            little too small leaves the object's own surface there, a smeared edge leaves points in the air. 0 for exact
            masks and edges.
        piece_px: a piece of a mask that depth jumps tear off the rest, and that reaches no further than this into the
            mask, belongs to what lies behind, unless it is half as large as the largest piece: its readings are
            dropped. It may reach twice as far if it is tiny and wholly behind the largest piece. Stereo matchers give
            a few pixels along an edge the depth of the other side, or of the far wall. 0 keeps all.
    """

    min_depth_m: float = 0.1
    max_depth_m: float = 10.0
    min_pixels: int = 15
    min_target_pixels: int = 30
    min_points: int = 8
    edge_slope: float = 8.0
    normal_radius_px: int = 2
    stride: int = 1
    background_stride: int = 3
    rim_px: int = 0
    piece_px: int = 0

    def at(self, shape: tuple[int, ...]) -> "PerceptionConfig":
        """Return the settings for a picture (rows, columns) with more pixels.

        A patch of surface, or an error of a matcher or a mask, then covers more pixels. Smaller pictures
        change nothing.
        """
        s = finer(shape)
        if s == 1:
            return self
        lengths = ("normal_radius_px", "rim_px", "piece_px")
        areas = ("min_pixels", "min_target_pixels")
        changed = {name: round(s * getattr(self, name)) for name in lengths}
        return replace(self, **changed, **{name: round(s * s * getattr(self, name)) for name in areas})

    @classmethod
    def rough(cls) -> "PerceptionConfig":
        """Return the settings for depth with a sensor's errors."""
        return REAL_CAMERA

    def __post_init__(self) -> None:
        if not 0 < self.min_depth_m < self.max_depth_m:
            raise InputError(f"Depth range {self.min_depth_m}..{self.max_depth_m} m is not a range above 0.")
        least = {"stride": 1, "background_stride": 1, "normal_radius_px": 1, "min_pixels": 1}
        least |= {"min_target_pixels": 1, "min_points": 1, "rim_px": 0, "piece_px": 0}
        for name, low in least.items():
            if getattr(self, name) < low:
                raise InputError(
                    f"PerceptionConfig.{name} is {getattr(self, name)}; it must be at least {low}."
                )


REAL_CAMERA = PerceptionConfig(edge_slope=4.0, normal_radius_px=3, rim_px=2, piece_px=5)
"""For sensors that smear edges, and masks that are a pixel or two off."""


_TINY = 20
"""A piece this many times smaller than the largest one is tiny."""


def valid_depth(
    depth_m: Float32[np.ndarray, "h w"], min_depth_m: float, max_depth_m: float
) -> Float32[np.ndarray, "h w"]:
    """Return depth with 0 wherever there is no usable reading."""
    with np.errstate(invalid="ignore"):
        good = (depth_m >= min_depth_m) & (depth_m <= max_depth_m)
    return np.where(good, depth_m, np.float32(0))


def segment(
    observation: Observation, label_image: Int16[np.ndarray, "h w"], config: PerceptionConfig
) -> SegmentedScene:
    """Return the scene that a label image makes of a snapshot.

    Objects with too few pixels are not reported; their points join the background, so that they remain obstacles. The
    scene's observation has no depth where a mask holds readings of what lies behind it (`piece_px`).

    Raises:
        InputError: the labels fit neither image nor ids.
    """
    counts = _pixel_counts(observation, label_image)
    config = config.at(label_image.shape)
    depth = kernel_array(valid_depth(observation.depth_m, config.min_depth_m, config.max_depth_m), np.float32)
    label = kernel_array(label_image, np.int16)
    slope = config.edge_slope / float(min(observation.K[0, 0], observation.K[1, 1]))
    if config.piece_px:
        torn = _torn_off(depth, label, slope, config.piece_px)
        depth = np.where(torn, np.float32(0), depth)
        observation = replace(observation, depth_m=np.where(torn, np.float32(0), observation.depth_m))
    large = counts >= config.min_pixels
    large[TARGET_ID] = counts[TARGET_ID] >= config.min_target_pixels
    pixels = surface_pixels(depth, label, _pixels_of(large, label, config.stride), slope)
    point_counts = np.bincount(label[pixels[:, 0], pixels[:, 1]], minlength=MAX_OBJECTS)
    reported = large & (point_counts >= config.min_points)
    if np.any(reported != large):
        pixels = pixels[reported[label[pixels[:, 0], pixels[:, 1]]]]
    objects = _objects(observation, depth, label, pixels, counts, slope, config)
    # The background is thinned out, what is too small to be an object is not.
    around = _pixels_of(~reported, label)
    every = (slice(None, None, config.background_stride),) * 2
    around[every] |= label[every] == BACKGROUND
    background = surface_pixels(depth, label, around & ~_rims(label, reported, config.rim_px), slope)
    return SegmentedScene(
        observation=observation,
        label_image=label_image,
        objects=objects,
        target_id=TARGET_ID if reported[TARGET_ID] else None,
        background_points=_points(observation, depth, background),
    )


class LabelPerception(PerceptionTraits):
    """Takes the masks from a given label image (the paper's privileged perception)."""

    needs_labels = True

    def __init__(self, config: PerceptionConfig | None = None) -> None:
        self.config = PerceptionConfig() if config is None else config

    def perceive(
        self,
        observation: Observation,
        wanted: Wanted | None = None,
        before: SegmentedScene | None = None,
        label_image: Int16[np.ndarray, "h w"] | None = None,
    ) -> SegmentedScene:
        """Return the objects under the labels, whatever is wanted. Raises InputError without labels."""
        if label_image is None:
            raise InputError(
                "This snapshot has no label image. Give one (object id per pixel, -1 for the background), or use a "
                "perception that finds the masks itself."
            )
        return segment(observation, label_image, self.config)


def _pixel_counts(observation: Observation, label_image: np.ndarray) -> np.ndarray:
    """Return mask sizes by id."""
    shape = observation.depth_m.shape
    if label_image.shape != shape or observation.rgb.shape[:2] != shape:
        raise InputError(
            f"Image sizes differ: depth {shape}, labels {label_image.shape}, colour {observation.rgb.shape[:2]}. "
            "All three must be registered to one camera."
        )
    low, high = min(ROBOT, BACKGROUND), MAX_OBJECTS - 1
    if label_image.size == 0 or label_image.min() < low or label_image.max() > high:
        raise InputError(
            f"The label image is empty or holds labels outside {low}..{high}; renumber the objects."
        )
    return np.asarray(count_labels(kernel_array(label_image, np.int16), MAX_OBJECTS))


def _torn_off(
    depth: Float32[np.ndarray, "h w"], label: Int16[np.ndarray, "h w"], slope: float, piece_px: int
) -> Bool[np.ndarray, "h w"]:
    """Return the pixels of pieces that lie along their mask's edge and are connected to nothing within it."""
    torn_off = np.zeros(depth.shape, dtype=bool)
    col, row, width, height = cv2.boundingRect((label >= 0).view(np.uint8))
    # One pixel more, so that edges on its border are seen.
    box = slice(max(row - 1, 0), row + height + 1), slice(max(col - 1, 0), col + width + 1)
    depth, label = depth[box].copy(), label[box].copy()
    piece, count = find_pieces(depth, label, slope)
    if count == 0:
        return torn_off
    inner = np.ones(label.shape, np.uint8)
    for a, b in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
        inner[a] &= label[a] == label[b]
        inner[:, a] &= label[:, a] == label[:, b]
    inside_px = cv2.distanceTransform(inner, cv2.DIST_L2, cv2.DIST_MASK_5)
    size, owner, reach, near_m, far_m = measure_pieces(piece, count, depth, label, inside_px)
    # Ascending sizes: the largest of each mask's pieces is set last.
    largest, order = np.zeros(MAX_OBJECTS, np.int64), np.argsort(size, kind="stable")
    largest[owner[order]] = order
    main = largest[owner]
    behind = (_TINY * size < size[main]) & (near_m > far_m[main])
    torn = (2 * size < size[main]) & (reach < np.where(behind, 2 * piece_px, piece_px))
    torn_off[box] = looked_up(np.append(torn, False), piece)
    return torn_off


def _pixels_of(
    ids: Bool[np.ndarray, "ids"], label: Int16[np.ndarray, "h w"], stride: int = 1
) -> Bool[np.ndarray, "h w"]:
    """Return every stride-th pixel with one of these ids."""
    # The numbers of background and robot, below 0, are looked up from the end.
    pixels = np.asarray(looked_up(np.append(ids, [False, False]), label))
    if stride > 1:
        pixels &= np.add.outer(*(np.arange(n) % stride for n in label.shape)) == 0
    return pixels


def _rims(
    label: Int16[np.ndarray, "h w"], reported: Bool[np.ndarray, "ids"], rim_px: int
) -> Bool[np.ndarray, "h w"]:
    """Return the pixels within rim_px of a reported object's mask, including the masks."""
    if rim_px == 0:
        return np.zeros(label.shape, dtype=bool)
    masks = _pixels_of(reported, label)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * rim_px + 1, 2 * rim_px + 1))
    return np.asarray(cv2.dilate(masks.view(np.uint8), kernel), dtype=bool)


def _points(
    observation: Observation, depth: np.ndarray, pixels: Int32[np.ndarray, "n 2"]
) -> Float32[np.ndarray, "n 3"]:
    return lift_pixels(depth, pixels, kernel_array(observation.K), kernel_array(observation.T_world_camera))


def _objects(
    observation: Observation,
    depth: np.ndarray,
    label: np.ndarray,
    pixels: Int32[np.ndarray, "n 2"],
    counts: np.ndarray,
    slope: float,
    config: PerceptionConfig,
) -> tuple[SegmentedObject, ...]:
    """Return one record per id among the pixels, by rising id."""
    labels = label[pixels[:, 0], pixels[:, 1]]
    order = np.argsort(labels, kind="stable")
    pixels, labels = kernel_array(pixels[order], np.int32), labels[order]
    K, R = kernel_array(observation.K), kernel_array(observation.T_world_camera[:3, :3])
    planes, residuals, radius = np.zeros((len(pixels), 3)), np.empty(len(pixels)), config.normal_radius_px
    each(
        lambda s: fit_planes(depth, label, pixels[s], slope, radius, planes[s], residuals[s]),
        shares(len(pixels)),
    )
    normals = normals_of_planes(planes, residuals, depth, pixels, K, R, radius)
    points = _points(observation, depth, pixels)
    ids, first = np.unique(labels, return_index=True)
    last = np.append(first[1:], len(labels))
    return tuple(
        SegmentedObject(int(i), points[a:b], normals[a:b], pixels[a:b], int(counts[i]))
        for i, a, b in zip(ids, first, last)
    )
