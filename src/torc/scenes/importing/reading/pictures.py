"""Textures of mesh files, and the files that a mesh names."""

import io
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, UnidentifiedImageError

from torc.errors import InputError

_MAX_IMAGE_SIDE_PX, _MAX_IMAGE_PIXELS = 16_384, 80_000_000
_IMAGE_FORMATS = ("PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF")
"""Pillow knows more, some of which start other programs."""
_FAULTS = (
    OSError,
    SyntaxError,
    ValueError,
    EOFError,
    Image.DecompressionBombError,
    Image.DecompressionBombWarning,
)
_MAX_SIDE_FILES_BYTES = 300 * 2**20
_MAX_GREY = 2**16 - 1
_TIFF_BITS, _TIFF_SENSE, _WHITE_IS_ZERO = 258, 262, 0


class Neighbours:
    """A mesh's materials and textures: plain files below one directory, no others.

    Readers go on quietly when one is not to be had, so what was refused or missing is written down here.
    """

    def __init__(self, directory: Path, root: Path) -> None:
        self._directory, self._root, self._left = directory.resolve(), root.resolve(), _MAX_SIDE_FILES_BYTES
        self.refused: list[str] = []
        self.missing: list[str] = []

    def get(self, name: str) -> bytes:
        """The content of a file named in the mesh or its materials. Raises OSError if it is refused or missing."""
        name = str(name).strip().strip('"')
        path = self._inside(name)
        if path is None:
            self.refused.append(f"it names '{name[:120]}', which is not below {self._root}")
            raise OSError(name)
        size = _size(path)
        if size is None:
            self.missing.append(name[:120])
            raise FileNotFoundError(name)
        if size > self._left:
            self.refused.append(f"with '{name[:120]}' it is more than {_MAX_SIDE_FILES_BYTES // 2**20} MB")
            raise OSError(name)
        try:
            data = path.read_bytes()
        except OSError as error:
            self.refused.append(f"'{name[:120]}', which it names, cannot be opened ({error.strerror})")
            raise
        self._left -= len(data)
        if path.suffix.lower() != ".mtl":
            self._look_at(data, name)
        return data

    def _look_at(self, data: bytes, name: str) -> None:
        """What a reader cannot open it leaves out without a word."""
        try:
            with Image.open(io.BytesIO(data)) as image:
                _check_picture(image)
        except _FAULTS as error:
            self.refused.append(f"its texture '{name[:120]}' cannot be used ({_reason(error)})")
            raise OSError(name) from error

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)

    def _inside(self, name: str) -> Path | None:
        """Where it is, links followed; None outside of the root."""
        relative = name.replace("\\", "/")
        if not relative or "\0" in relative or ":" in relative or relative.startswith(("/", "~")):
            return None
        try:
            path = (self._directory / relative).resolve()
        except (OSError, RuntimeError, ValueError):
            return None
        return path if path.is_relative_to(self._root) else None


def picture_of(data: bytes, texture_px: int, path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """A texture's picture out of a file's bytes; see `picture`."""
    try:
        image = Image.open(io.BytesIO(data))
    except _FAULTS as error:
        raise _unusable(path, error) from None
    return picture(image, texture_px, path)


def picture(image: Image.Image, texture_px: int, path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """A texture's colours, scaled down to a longest side of texture_px.

    Raises:
        InputError: too large, damaged, or of a format that is not read; `path` names the mesh file.
    """
    try:
        _check_picture(image)
        small = (_grey(image) if image.mode.startswith("I") else image).convert("RGB")
        if max(small.size) > texture_px:
            factor = texture_px / max(small.size)
            size = (max(1, round(factor * small.width)), max(1, round(factor * small.height)))
            small = small.resize(size, Image.Resampling.LANCZOS)
    except _FAULTS as error:
        raise _unusable(path, error) from None
    return np.asarray(small, np.uint8)


def _size(path: Path) -> int | None:
    """Bytes of a plain file; None if there is none, or no file can have the name."""
    try:
        return path.stat().st_size if path.is_file() else None
    except OSError:
        return None


def _grey(image: Image.Image) -> Image.Image:
    """8 bits of a grey picture of more, which Pillow cuts off at 255 instead of scaling."""
    values = np.asarray(image)
    if values.min() < 0 or values.max() > _MAX_GREY:
        raise ValueError("its grey values are not of 16 bits; save it with 8 bits per colour")
    tags = getattr(image, "tag_v2", {})  # of a TIFF
    most = 2**12 - 1 if tags.get(_TIFF_BITS) == (12,) else _MAX_GREY
    grey = np.round(values * np.float32(255 / most)).astype(np.uint8)
    return Image.fromarray(255 - grey if tags.get(_TIFF_SENSE) == _WHITE_IS_ZERO else grey)


def _reason(error: BaseException) -> str:
    if isinstance(error, UnidentifiedImageError):  # Pillow's own words name an object in memory
        return "it is of no picture format that is read; PNG and JPEG are"
    return str(error) or type(error).__name__


def _unusable(path: Path, error: BaseException) -> InputError:
    return InputError(
        f"{path}: a texture cannot be used ({_reason(error)}). Repair it, or leave textures out (--no-textures)."
    )


def _check_picture(image: Image.Image) -> None:
    """Raises ValueError for a picture that is not to be unpacked."""
    if image.format not in _IMAGE_FORMATS:
        raise ValueError(f"it is {image.format or 'of an unknown format'}; PNG and JPEG are read")
    if max(image.size) > _MAX_IMAGE_SIDE_PX or image.width * image.height > _MAX_IMAGE_PIXELS:
        raise ValueError(f"{image.width}x{image.height} pixels are too many")
    if image.mode == "F":
        raise ValueError("its colours are fractions, which are not read; save it with 8 bits per colour")
