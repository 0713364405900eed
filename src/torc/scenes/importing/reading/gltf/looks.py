"""Colours and textures of a GLB file's parts."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, UInt8
from pydantic import BaseModel

from torc.scenes.importing.reading.gltf.glb import Corners, Glb, GlbError, entry, parsed
from torc.scenes.importing.reading.gltf.schema import (
    Material,
    Primitive,
    SpecularGlossiness,
    TextureInfo,
    TextureTransform,
)
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface, coloured, textured

_SPECULAR, _TRANSFORM, _WEBP = (
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_texture_transform",
    "EXT_texture_webp",
)
_UNLIT, _TRANSMISSION = "KHR_materials_unlit", "KHR_materials_transmission"
_SEE_THROUGH = ("BLEND", "MASK")
_REPEAT = 10497


@dataclass(frozen=True, eq=False)
class _Look:
    """A material's colour, linear light; the texture that it multiplies; whether vertex colours do so too."""

    factor: Float[np.ndarray, "3"] = field(default_factory=lambda: np.ones(3))
    texture: TextureInfo | None = None
    is_tinted: bool = True


class GltfLooks:
    """Dresses surfaces in the materials, vertex colours and textures of their parts. All raise GlbError.

    Factors and vertex colours are linear light, textures are for the screen (glTF 2.0, section 3.9.2).
    """

    def __init__(self, glb: Glb, reading: Reading) -> None:
        self._glb, self._reading = glb, reading
        self._pictures: dict[int, UInt8[np.ndarray, "h w 3"]] = {}

    def dressed(self, surface: Surface, primitive: Primitive, corners: Corners) -> Surface:
        """The surface, which has the corners that are in use, as its material and vertex colours have it."""
        look = _Look()
        if primitive.material is not None:
            look = self._look(entry(self._glb.gltf.materials, primitive.material, "materials"))
        tints = self._vertex_colours(primitive, corners) if look.is_tinted else None
        if tints is not None:
            surface = coloured(surface, np.round(255 * _for_screen(look.factor * tints)).astype(np.uint8))
        elif primitive.material is not None:
            r, g, b = (float(c) for c in _for_screen(look.factor))
            surface = replace(surface, rgba=(r, g, b, 1.0))
        info = look.texture
        if info is None:
            return surface
        transform = parsed(TextureTransform, info.extensions.get(_TRANSFORM, {}), _TRANSFORM)
        which = info.texCoord if transform.texCoord is None else transform.texCoord
        uv = self._coordinates(primitive, which, corners)
        if uv is None:
            self._reading.note("A texture without coordinates was left out.")
            return surface
        uv = _transformed(uv, transform)
        return textured(surface, uv, self._picture(info, uv))

    def _look(self, material: Material) -> _Look:
        """Of a material. What is black but for the light that it gives off has that light as its colour."""
        if material.alphaMode in _SEE_THROUGH or _TRANSMISSION in material.extensions:
            self._reading.note("Transparent parts are shown opaque.")
        look = _base(material)
        emission = _unit(material.emissiveFactor)
        if _UNLIT in material.extensions or not emission.any():
            return look
        if not look.factor.any():
            return _Look(emission, material.emissiveTexture, is_tinted=False)
        self._reading.note("Light that parts give off is not shown.")
        return look

    def _vertex_colours(self, primitive: Primitive, corners: Corners) -> Float[np.ndarray, "n 3"] | None:
        if "COLOR_0" not in primitive.attributes:
            return None
        tints = self._glb.values(primitive.attributes["COLOR_0"], ("VEC3", "VEC4"), corners)
        if tints.dtype.kind != "f":
            raise GlbError("vertex colours (COLOR_0) must be fractions; leave them out with --no-textures")
        return np.clip(np.nan_to_num(tints[:, :3]), 0.0, 1.0)

    def _coordinates(
        self, primitive: Primitive, which: int, corners: Corners
    ) -> Float[np.ndarray, "n 2"] | None:
        name = f"TEXCOORD_{which}"
        if name not in primitive.attributes:
            return None
        return self._glb.values(primitive.attributes[name], ("VEC2",), corners).astype(np.float64)

    def _picture(self, info: TextureInfo, uv: Float[np.ndarray, "n 2"]) -> UInt8[np.ndarray, "h w 3"]:
        gltf = self._glb.gltf
        texture = entry(gltf.textures, info.index, "textures")
        source = texture.source
        if source is None:
            source = parsed(_Source, texture.extensions.get(_WEBP, {}), _WEBP).source
        if source is None:
            packed = ", ".join(texture.extensions)[:80] or "no source"
            raise GlbError(
                f"textures[{info.index}] has no picture that is read ({packed}); export it as PNG or JPEG, or leave "
                "textures out (--no-textures)"
            )
        if texture.sampler is not None:
            sampler = entry(gltf.samplers, texture.sampler, "samplers")
            beyond = (uv.min(axis=0) < -1e-3) | (uv.max(axis=0) > 1.001)
            if (beyond & (np.array([sampler.wrapS, sampler.wrapT]) != _REPEAT)).any():
                self._reading.note("A texture is repeated where the file has it clamped or mirrored.")
        if source not in self._pictures:
            data = self._glb.image_bytes(entry(gltf.images, source, "images"))
            self._pictures[source] = self._reading.texture_within(data)
        return self._pictures[source]


class _Source(BaseModel):
    """An extension that names another picture."""

    source: int | None = None


def _base(material: Material) -> _Look:
    """Base colour and its texture."""
    if _SPECULAR in material.extensions:
        older = parsed(SpecularGlossiness, material.extensions[_SPECULAR], _SPECULAR)
        return _Look(_unit(older.diffuseFactor), older.diffuseTexture)
    rough = material.pbrMetallicRoughness
    return _Look(_unit(rough.baseColorFactor), rough.baseColorTexture)


def _unit(factor: tuple[float, ...]) -> Float[np.ndarray, "3"]:
    return np.clip(factor[:3], 0.0, 1.0)


def _for_screen(linear: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Linear light to the values of sRGB (IEC 61966-2-1)."""
    bright = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.clip(np.where(linear <= 0.0031308, 12.92 * linear, bright), 0.0, 1.0).round(9)


def _transformed(uv: Float[np.ndarray, "n 2"], transform: TextureTransform) -> Float[np.ndarray, "n 2"]:
    """KHR_texture_transform: scaled, turned, moved. The turn is counter-clockwise where v points down, as viewers and
    the sample models have it; the matrix in the extension's text has the other sense."""
    c, s = np.cos(transform.rotation), np.sin(transform.rotation)
    with np.errstate(over="ignore", invalid="ignore"):
        return uv * transform.scale @ np.array([[c, -s], [s, c]]) + transform.offset
