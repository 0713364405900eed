"""Results on disk: JSON that is there whole or not at all, and pictures."""

import json
import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8


def write_json(path: Path, data: Any) -> None:
    """Write JSON atomically: a reader sees the whole file or none. Raises OSError where it cannot."""
    temporary = path.with_name(path.name + ".tmp")
    with open(temporary, "w", encoding="utf-8") as f:
        json.dump(data, f, indent=2)
        f.write("\n")
        f.flush()
        os.fsync(f.fileno())
    os.replace(temporary, path)


def write_png(path: Path, rgb: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write a picture. Raises OSError where it cannot."""
    path.write_bytes(png_bytes(rgb))


def png_bytes(rgb: UInt8[np.ndarray, "h w 3"]) -> bytes:
    """A picture as a PNG file; the same picture gives the same bytes."""
    _, encoded = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    return encoded.tobytes()
