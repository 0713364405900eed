"""GLB files for the tests, built piece by piece, and what is read of them."""

import json
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from mesh_files import box, png, two_tone, write_glb

from torc.scenes.importing.reading import read_surfaces
from torc.scenes.importing.surfaces import Surface

SIZE = (0.06, 0.16, 0.21)
VERTICES, FACES = box(SIZE)
UV = (VERTICES[:, 1:] / SIZE[1:] + 0.5).astype("<f4")


class GlbBuilder:
    """Writes GLB files of one part each, piece by piece."""

    KINDS: ClassVar[dict[str, int]] = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}

    def __init__(self) -> None:
        self.gltf: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "bufferViews": [],
            "accessors": [],
            "meshes": [{"primitives": [{"attributes": {}}]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
        }
        self._data = b""

    @property
    def primitive(self) -> dict[str, Any]:
        return self.gltf["meshes"][0]["primitives"][0]

    def view(self, data: bytes) -> int:
        self._data += b"\0" * (-len(self._data) % 4)
        self.gltf["bufferViews"].append({"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)})
        self._data += data
        return len(self.gltf["bufferViews"]) - 1

    def accessor(self, values: np.ndarray, normalized: bool = False) -> int:
        values = np.asarray(values)
        width = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        entry = {"bufferView": self.view(values.tobytes()), "count": len(values), "type": width}
        entry["componentType"] = self.KINDS[values.dtype.str[1:]]
        self.gltf["accessors"].append(entry | ({"normalized": True} if normalized else {}))
        return len(self.gltf["accessors"]) - 1

    def attribute(self, name: str, values: np.ndarray, normalized: bool = False) -> None:
        self.primitive["attributes"][name] = self.accessor(values, normalized)

    def shape(self, vertices: np.ndarray, faces: np.ndarray) -> "GlbBuilder":
        self.attribute("POSITION", vertices.astype("<f4"))
        self.primitive["indices"] = self.accessor(faces.astype("<u2").reshape(-1))
        return self

    def material(self, content: dict[str, Any], image: bytes | None = None) -> None:
        """The part's material; the image is its textures' first."""
        self.gltf["materials"] = [content]
        self.primitive["material"] = 0
        if image is not None:
            self.gltf["images"] = [{"bufferView": self.view(image), "mimeType": "image/png"}]
            self.gltf["textures"] = [{"source": 0}]

    def write(self, path: Path) -> Path:
        self._data += b"\0" * (-len(self._data) % 4)
        return write_glb(
            path, json.dumps(self.gltf | {"buffers": [{"byteLength": len(self._data)}]}), self._data
        )


def glb_of_box() -> GlbBuilder:
    """A box of SIZE."""
    return GlbBuilder().shape(VERTICES, FACES)


def textured_box(
    info: dict[str, Any] | None = None, uv: np.ndarray = UV, name: str = "TEXCOORD_0"
) -> GlbBuilder:
    """The box with a picture, red above and blue below."""
    builder = glb_of_box()
    builder.attribute(name, uv, normalized=uv.dtype.kind == "u")
    texture = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **(info or {})}}}
    builder.material(texture, png(two_tone(32)))
    return builder


def is_white(surface: Surface) -> bool:
    """Plain white."""
    return surface.rgba == (1.0, 1.0, 1.0, 1.0) and surface.colours is None


def read_glb_file(builder: GlbBuilder, directory: Path, textures: bool = True) -> list[Surface]:
    """Its surfaces."""
    path = builder.write(directory / "a.glb")
    return read_surfaces(path, 1.0, False, directory if textures else None, 64)[0]


def read_one(builder: GlbBuilder, directory: Path) -> Surface:
    """Its only surface."""
    (surface,) = read_glb_file(builder, directory)
    return surface


def notes_on(builder: GlbBuilder, directory: Path) -> list[str]:
    """What a user is told."""
    return read_surfaces(builder.write(directory / "a.glb"), 1.0, False, directory, 64)[1]
