"""Store and load scenes to lay out repeatedly (`torc-scene/2`): directories with a reference and a target."""

import os
import re
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from torc import InputError, Observation, Wanted
from torc.drawing.marking import mark_image
from torc.io.digests import fingerprint
from torc.io.pictures import write_png
from torc.io.reading import read_bytes
from torc.io.record_files import load_checked, save_record
from torc.io.results import check_place, write_json
from torc.io.strict_yaml import explain_faults
from torc.perception.checked_scenes import ask_camera, ask_depth, ask_perception
from torc.perception.protocol import Picture
from torc.perception.target import MAX_PICTURES, load_pictures
from torc.pipeline.building import make_stage
from torc.pipeline.frames.plausibility import clean_depth
from torc.records import BACKGROUND, TARGET_ID, Capture, SegmentedScene
from torc.registry.context import BuildContext
from torc.registry.kinds import DEPTHS, PERCEPTIONS
from torc.robots.protocols import Camera
from torc.trials.log import digest
from torc_lab.lab_file import Lab
from torc_lab.person import say_in_terminal
from torc_lab.protocols import LabError

SCENE_FORMAT = "torc-scene/2"
FACTS, REFERENCE, SEEN = "scene.json", "reference.npz", "seen.png"
PICTURES = 5
"""Number of snapshots whose median is the reference."""
_NAME = r"\w[\w.-]{0,63}"
_FROZEN_S, _BETWEEN_S = 3.0, 0.05
_LEAST_PX = 60
"""Objects with fewer pixels are dropped: their overlap would mean nothing."""
_MAX_BYTES, _MAX_FACTS_BYTES = 512 * 2**20, 2**20
_AGAIN = "Store it again: `torc lab scene`."


@dataclass(frozen=True)
class Scene:
    """Which objects lie where, and which one is the target.

    Attributes:
        name: identifies the problem in results, after "scene-".
        lab: name of the lab file with which it was stored.
        wanted: the target.
        reference: the median of several snapshots. Its `label_image` holds perception's masks, with the numbers of
            `seen.png`: 0 is the target, if it was in sight.
    """

    name: str
    lab: str
    wanted: Wanted
    reference: Capture = field(repr=False)

    @property
    def problem(self) -> str:
        """Return the problem's name in results; no shipped problem has such a name."""
        return f"scene-{self.name}"

    @cached_property
    def ids(self) -> tuple[int, ...]:
        """Return the objects' numbers, ascending."""
        label = self.reference.label_image
        return () if label is None else tuple(np.unique(label[label >= 0]).tolist())

    @property
    def target_in_sight(self) -> bool:
        """Return whether perception identified the target in the reference."""
        return TARGET_ID in self.ids

    @cached_property
    def digest(self) -> str:
        """Return a digest of the reference and the target."""
        reference, wanted = self.reference, self.wanted
        o, label = reference.observation, reference.label_image
        arrays = [o.rgb, o.depth_m, *([] if label is None else [label]), *wanted.pictures]
        told = {"told": wanted.description, "mark": list(wanted.mark), "seen": digest(*arrays)}
        return fingerprint(told if wanted.size_m is None else {**told, "size_m": list(wanted.size_m)})


class _SceneFile(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)
    format: Literal["torc-scene/2"]
    name: Annotated[str, Field(pattern=f"^{_NAME}$")]
    lab: Annotated[str, Field(max_length=100)]
    description: Annotated[str, Field(max_length=10_000)]
    mark: Annotated[tuple[int, ...], Field(max_length=4)]
    pictures: Annotated[int, Field(ge=0, le=MAX_PICTURES)]
    size_m: tuple[float, float] | None = None


class Eyes:
    """Takes snapshots as a lab's trials see them, with its depth and perception stages."""

    def __init__(self, lab: Lab, camera: Camera) -> None:
        """Use an open camera. Raises InputError if the depth stage cannot be made."""
        self._lab, self._camera, self._last_stamp_s = lab, camera, 0.0
        self._depth = make_stage(lab.conditions, "depth", BuildContext(workspace=lab.workspace))

    def look(self) -> Observation:
        """Return a new snapshot, without labels even if its source knows them.

        Raises LabError if the camera repeats one picture, and InputError, CameraError or PartError.
        """
        given_up = time.monotonic() + _FROZEN_S
        while (found := ask_camera(self._camera).observation).stamp_s == self._last_stamp_s != 0:
            if time.monotonic() > given_up:
                raise LabError("The camera is frozen: it gives the same picture again and again.")
            time.sleep(_BETWEEN_S)
        self._last_stamp_s = found.stamp_s
        found = ask_depth(self._depth, found)
        return replace(found, depth_m=clean_depth("The snapshot", found.depth_m), pair=None)

    def find(self, seen: Observation, wanted: Wanted) -> SegmentedScene:
        """Return the objects in a snapshot. Raises InputError if the perception needs labels or cannot be made."""
        context = BuildContext(workspace=self._lab.workspace)
        rough = DEPTHS.traits(self._depth).rough
        perception = make_stage(self._lab.conditions, "perception", context, rough=rough)
        if PERCEPTIONS.traits(perception).needs_labels:
            raise InputError(
                "Perception 'labels' finds nothing in real pictures: name another in the lab file."
            )
        return ask_perception(perception, Capture(seen), wanted, None)


def record_scene(
    name: str,
    lab: Lab,
    wanted: Wanted,
    eyes: Eyes,
    pictures: int = PICTURES,
    say: Callable[[str], None] = say_in_terminal,
) -> tuple[Scene, SegmentedScene]:
    """Record the scene before the camera; return it and perception's result.

    Args:
        name: the scene's name.
        wanted: the target.
        pictures: number of snapshots whose median is the reference.
        say: shows a message to the person.

    Raises:
        InputError: no object is in sight.
    """
    say(f"Taking {pictures} pictures: leave everything as it is.")
    shots = [eyes.look() for _ in range(pictures)]
    found = eyes.find(median_picture(shots), wanted)
    label = np.where(np.isin(found.label_image, found.ids), found.label_image, BACKGROUND).astype(np.int16)
    for k in found.ids:
        if np.count_nonzero(label == k) < _LEAST_PX:
            label[label == k] = BACKGROUND
    label[label == found.target_number] = TARGET_ID
    if not (label >= 0).any():
        raise InputError(
            "No object is in sight. Lay the scene out first; `torc camera show` and `torc lab check` tell what the "
            "camera sees."
        )
    return Scene(name, lab.name, wanted, Capture(found.observation, label)), found


def median_picture(shots: Sequence[Observation]) -> Observation:
    """Return the median of snapshots of one scene, else as the last one; depth where at least half have a reading."""
    read = np.stack([np.where(s.depth_m > 0, s.depth_m, np.nan) for s in shots])
    often = np.isfinite(read).mean(axis=0) >= 0.5
    depth = np.zeros(often.shape, np.float32)
    depth[often] = np.nanmedian(read[:, often], axis=0)
    color = np.rint(np.median(np.stack([s.rgb for s in shots]), axis=0)).astype(np.uint8)
    return replace(shots[-1], rgb=color, depth_m=depth)


def check_scene_place(directory: Path, overwrite: bool) -> None:
    """Raise InputError if a scene cannot be stored there. Call it before the scene is laid out."""
    check_place(directory, overwrite, FACTS, "scene")
    if not re.fullmatch(_NAME, directory.name):
        raise InputError(f"A scene's name has letters, digits, '.', '_' and '-', unlike '{directory.name}'.")


def save_scene(
    scene: Scene, directory: Path, overwrite: bool = False, found: SegmentedScene | None = None
) -> None:
    """Write the directory of a scene, completely or not at all.

    Args:
        found: perception's result, to draw the picture with the numbers; without it there is no picture.

    Raises:
        InputError: the directory exists and `overwrite` is False, is not a scene, or cannot be written.
    """
    check_scene_place(directory, overwrite)
    aside = directory.with_name(directory.name + ".partial")
    facts = {
        "format": SCENE_FORMAT,
        "name": scene.name,
        "lab": scene.lab,
        "description": scene.wanted.description,
        "mark": list(scene.wanted.mark),
        "pictures": len(scene.wanted.pictures),
        "size_m": scene.wanted.size_m and list(scene.wanted.size_m),
        "objects": list(scene.ids),
    }
    try:
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir(parents=True)
        save_record(scene.reference, aside / REFERENCE)
        for number, picture in enumerate(scene.wanted.pictures):
            Image.fromarray(picture).save(aside / _picture(number))
        if found is not None:
            write_png(aside / SEEN, mark_image(found, labels={found.target_number: TARGET_ID}))
        write_json(aside / FACTS, facts)
        if directory.exists():
            shutil.rmtree(directory)
        os.replace(aside, directory)
    except OSError as error:
        raise InputError(
            f"Cannot write to '{directory}': {error.strerror}. Choose another directory."
        ) from error


def is_scene(directory: Path) -> bool:
    """Return whether the directory holds a scene."""
    return (directory / FACTS).is_file()


def load_scene(directory: Path) -> Scene:
    """Load a stored scene. Raises InputError if it is missing or damaged; the files are not trusted."""
    if not is_scene(directory):
        raise InputError(f"'{directory}' holds no scene. `torc lab scene {directory} --lab FILE` stores one.")
    path = directory / FACTS
    try:
        facts = _SceneFile.model_validate_json(read_bytes(path, _MAX_FACTS_BYTES, "facts of a scene"))
    except ValidationError as error:
        raise InputError(
            f"{path} is damaged, or another version of torc stored it:\n{explain_faults(error)}\n{_AGAIN}"
        ) from None
    reference = load_checked(directory / REFERENCE, Capture, _MAX_BYTES, "reference of a scene")
    o, label = reference.observation, reference.label_image
    shape = o.depth_m.shape
    if label is None or label.dtype != np.int16 or label.shape != shape or o.rgb.shape != (*shape, 3):
        raise InputError(f"'{directory / REFERENCE}' holds no reference of a scene. {_AGAIN}")
    pictures: tuple[Picture, ...] = load_pictures([directory / _picture(k) for k in range(facts.pictures)])
    wanted = Wanted(facts.description, pictures, facts.mark, facts.size_m)
    return Scene(facts.name, facts.lab, wanted, reference)


def _picture(number: int) -> str:
    return f"target_{number + 1}.png"
