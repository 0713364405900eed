"""Results on disk: JSON that is there whole or not at all, and pictures."""

import base64
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


def jpeg_bytes(rgb: UInt8[np.ndarray, "h w 3"], quality: int = 92) -> bytes:
    """A picture as a JPEG file, a quarter of the size."""
    _, encoded = cv2.imencode(
        ".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    return encoded.tobytes()


def media_type(picture: bytes) -> str:
    """Of a file that is PNG or JPEG."""
    return "image/jpeg" if picture.startswith(b"\xff\xd8\xff") else "image/png"


def data_url(picture: bytes) -> str:
    """A PNG or JPEG file in the form in which pages and messages carry it."""
    return f"data:{media_type(picture)};base64,{base64.b64encode(picture).decode()}"
