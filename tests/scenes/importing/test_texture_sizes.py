"""Whatever a mesh brings along, its textures fit an object."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from mesh_files import BOX_FACES, box, two_tone

from torc.scenes.importing import MeshOptions, read_mesh
from torc.scenes.importing.texture_sizes import fitting_textures
from torc.scenes.library import load_object
from torc.scenes.object_files import load_object_directory, save_object
from torc.scenes.object_schema import MAX_TEXTURE_PIXELS
from torc.sim.object_check import world_with

SIZES = [(2048, 2048)] * 3 + [(1, 2048), (300, 1000)]


def _pixels(visuals) -> int:
    return sum(v.texture.shape[0] * v.texture.shape[1] for v in visuals if v.texture is not None)


def test_textures_are_scaled_alike_until_they_fit() -> None:
    plain = load_object("die_red").visuals[0]
    visuals = [replace(plain, texture=np.asarray(two_tone().resize(size))) for size in SIZES]
    visuals += [visuals[0], replace(plain, texture=None)]
    assert fitting_textures(visuals, _pixels(visuals)) == (visuals, 1.0)
    for max_pixels in (_pixels(visuals) - 1, 10**6, 1000):
        found, factor = fitting_textures(visuals, max_pixels)
        assert 0.75 * max_pixels < _pixels(found) <= max_pixels
        assert found[-1].texture is None
        assert found[0].texture is found[-2].texture
        for old, new in zip(SIZES, found):
            h, w = new.texture.shape[:2]
            assert (w, h) == tuple(max(1, int(factor * s)) for s in old)
    assert tuple(found[0].texture[0, 0]) == (220, 0, 0)


def _patchwork(path: Path, px: int) -> Path:
    """An open box: every triangle has a material of its own, all with a texture of that size."""
    two_tone(px).save(path.with_name("paper.png"))
    vertices, faces = box((0.06, 0.16, 0.21))[0], BOX_FACES[:-2]
    lines = [f"mtllib {path.stem}.mtl", *(f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist())]
    lines += ["vt 0 0", "vt 1 0", "vt 0 1"]
    for i, (a, b, c) in enumerate((faces + 1).tolist()):
        lines += [f"usemtl paper{i}", f"f {a}/1 {b}/2 {c}/3"]
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text(
        "".join(f"newmtl paper{i}\nmap_Kd paper.png\n" for i in range(len(faces)))
    )
    return path


def test_an_object_of_many_large_textures_can_be_stored(tmp_path: Path) -> None:
    found = read_mesh(_patchwork(tmp_path / "box.obj", 1024), MeshOptions())
    visuals = found.model.visuals
    assert len([v for v in visuals if v.texture is not None]) == 20  # both sides
    assert MAX_TEXTURE_PIXELS / 2 < _pixels(visuals) <= MAX_TEXTURE_PIXELS
    assert "Its textures are many and large: they were scaled down to 81 %." in found.notes
    save_object(found.model, tmp_path / "box", found.source)
    assert _pixels(load_object_directory(tmp_path / "box").visuals) == _pixels(visuals)
    world_with(found.model)  # surfaces of a single triangle
