"""Small pictures of picks for the strip of the history."""

import cv2
import numpy as np

from torc.episode.pictures import crop_around_objects
from torc.episode.recorded import RecordedTrial
from torc.errors import InputError
from torc.web.frames import jpeg

WIDTH = 200
MAX_PIXELS = 4096 * 4096


def thumbnail(trial: RecordedTrial, number: int) -> bytes:
    """What the planner saw at a pick, cropped to the objects, what it chose ringed in white; JPEG.

    Raises InputError where there is no picture.
    """
    png = trial.picture(number)
    # Width and height stand in the first chunk: nothing huge is unpacked.
    width, height = (int.from_bytes(png[i : i + 4], "big") for i in (16, 20))
    small = width * height <= MAX_PIXELS
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR_RGB) if small else None
    if image is None:
        raise InputError("The picture of this pick is damaged or too large.")
    view, decided = trial.view(number), trial.pick(number).decided
    if view is not None and view.label_image.shape == image.shape[:2]:
        if decided is not None and decided.object_id is not None:
            mask = (view.label_image == decided.object_id).astype(np.uint8)
            image[cv2.dilate(mask, np.ones((9, 9), np.uint8)) > mask] = 255
        image = image[crop_around_objects(view.label_image.astype(np.int16))]
    rows = max(1, round(WIDTH * image.shape[0] / image.shape[1]))
    return jpeg(cv2.resize(image, (WIDTH, rows), interpolation=cv2.INTER_AREA).astype(np.uint8))
