"""The textures of an object are bounded together, and none is unpacked where they are too many."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from torc.errors import InputError
from torc.files.strict_png import PackedPng
from torc.scenes.library import load_object
from torc.scenes.object_files import load_object_directory, save_object

FULL = np.zeros((2048, 2048, 3), np.uint8)


def _save(count: int, texture: np.ndarray, store: Path) -> Path:
    """A box with so many surfaces, each with that texture."""
    box = load_object("cracker_box_red")
    visual = replace(box.visuals[0], texture=texture)
    save_object(replace(box, visuals=(visual,) * count), store / box.name)
    return store / box.name


def test_what_is_allowed_together_is_read(tmp_path: Path) -> None:
    model = load_object_directory(_save(4, FULL, tmp_path))
    assert [v.texture.shape for v in model.visuals if v.texture is not None] == [FULL.shape] * 4


def test_textures_that_are_too_large_together_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    box = _save(4, FULL, tmp_path)
    Image.fromarray(FULL[:1, :1]).save(box / "texture_4.png")
    members = dict(np.load(box / "geometry.npz"))
    members |= {name.replace("_3_", "_4_"): array for name, array in members.items() if "visual_3_" in name}
    np.savez_compressed(box / "geometry.npz", **members)
    text = (box / "object.yaml").read_text()
    text += text[text.rindex("- rgba") :].replace("texture_3", "texture_4")
    (box / "object.yaml").write_text(text)
    monkeypatch.setattr(PackedPng, "unpack", lambda _: pytest.fail("unpacked"))
    with pytest.raises(InputError, match="its 5 textures have 16777217 pixels in all; at most 16777216"):
        load_object_directory(box)


def test_one_file_named_by_many_surfaces_counts_as_often(tmp_path: Path) -> None:
    box = _save(5, FULL[:1024], tmp_path)
    Image.fromarray(FULL).save(box / "texture_0.png")
    text = (box / "object.yaml").read_text()
    for i in range(1, 5):
        text = text.replace(f"texture_{i}.png", "texture_0.png")
    (box / "object.yaml").write_text(text)
    with pytest.raises(InputError, match="its 5 textures"):
        load_object_directory(box)


def test_what_could_not_be_read_again_is_not_saved(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its 5 textures"):
        _save(5, FULL, tmp_path)
    assert not (tmp_path / "cracker_box_red").exists()
