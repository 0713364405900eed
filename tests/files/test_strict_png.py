"""PNGs from strangers: they look as Pillow shows them, and nothing else in them is unpacked."""

import io
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from torc.errors import InputError
from torc.files.strict_png import read_png


def _chunk(kind: bytes, body: bytes) -> bytes:
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def _header(width: int, height: int) -> bytes:
    return _chunk(b"IHDR", width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x02\0\0\0")


def _png(width: int, height: int, more: bytes = b"") -> bytes:
    """A black picture, with further chunks between header and pixels."""
    pixels = zlib.compress((b"\0" * (1 + 3 * width)) * height)
    end = _chunk(b"IDAT", pixels) + _chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + _header(width, height) + more + end


def _read(tmp_path: Path, data: bytes, max_side_px: int = 64) -> np.ndarray:
    (tmp_path / "a.png").write_bytes(data)
    return read_png(tmp_path / "a.png", max_side_px, 2**20, "a texture").unpack()


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_every_kind_of_png_looks_as_pillow_shows_it(mode: str, tmp_path: Path) -> None:
    values = np.random.default_rng(0).integers(0, 255, (40, 30, 4), dtype=np.uint8)
    image = Image.fromarray(values)
    image = Image.fromarray(values.view(np.uint16)[..., 0]) if mode == "I;16" else image.convert(mode)
    assert image.mode == mode
    info = PngImagePlugin.PngInfo()
    info.add_text("Comment", "words", zip=True)
    hidden = {"transparency": 0} if mode in ("L", "P") else {}
    image.save(tmp_path / "b.png", pnginfo=info, dpi=(72, 72), icc_profile=b"profile", **hidden)
    data = (tmp_path / "b.png").read_bytes()
    expected = np.array(Image.open(io.BytesIO(data)).convert("RGB"))
    np.testing.assert_array_equal(_read(tmp_path, data), expected)
    np.testing.assert_array_equal(_read(tmp_path, data + b"\0" * 10**6), expected)


def test_its_size_is_known_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Image, "open", lambda *_, **__: pytest.fail("unpacked"))
    (tmp_path / "a.png").write_bytes(_png(50, 30))
    packed = read_png(tmp_path / "a.png", 64, 2**20, "a texture")
    assert (packed.width, packed.height, packed.pixels) == (50, 30, 1500)
    with pytest.raises(InputError, match="50x30 pixels; at most 49 a side"):
        _read(tmp_path, _png(50, 30), max_side_px=49)


@pytest.mark.parametrize("kind", [b"zTXt", b"iTXt", b"iCCP", b"acTL", b"fdAT", b"xxXx"])
def test_what_is_no_picture_is_not_looked_at(kind: bytes, tmp_path: Path) -> None:
    comment = _chunk(kind, b"k\0\0" + zlib.compress(b"x" * 2**20))
    (tmp_path / "a.png").write_bytes(_png(8, 8, comment * 60))
    packed = read_png(tmp_path / "a.png", 64, 2**20, "a texture")
    assert packed.data == _png(8, 8)
    assert packed.unpack().shape == (8, 8, 3)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (_png(0, 8), "no pixels"),
        (_png(8, 8, _header(60_000, 60_000)), "more than one size"),
        (_png(8, 8, _chunk(b"xxXx", b"") * 20_000), "more than 20000 parts"),
        (_png(8, 8)[:-30], "no readable picture"),
        (_png(8, 8)[:20], "does not begin like one"),
        (_png(8, 8).replace(b"IDAT", b"xDAT"), "no readable picture"),
        (b"\xff\xd8\xff\xe0" + b"\0" * 100, "does not begin like one"),
    ],
)
def test_what_is_no_sound_png_is_refused(data: bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        _read(tmp_path, data)
