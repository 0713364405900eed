"""Colours and textures of a GLB file's parts."""

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float, UInt8
from pydantic import BaseModel, ValidationError

from torc.scenes.importing.reading.glb import Glb, GlbError, entry
from torc.scenes.importing.reading.gltf_schema import (
    Material,
    Primitive,
    SpecularGlossiness,
    TextureInfo,
    TextureTransform,
)
from torc.scenes.importing.reading.pictures import picture_of
from torc.scenes.importing.reading.request import Reading
from torc.scenes.importing.surfaces import Surface, coloured, textured
from torc.scenes.strict_yaml import explain_faults

_SPECULAR, _TRANSFORM, _WEBP = (
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_texture_transform",
    "EXT_texture_webp",
)
_REPEAT = 10497
_Model = TypeVar("_Model", bound=BaseModel)


class GltfLooks:
    """Dresses surfaces in the materials, vertex colours and textures of their parts. All raise GlbError.

    Factors and vertex colours are linear light, textures are for the screen (glTF 2.0, section 3.9.2).
    """

    def __init__(self, glb: Glb, reading: Reading) -> None:
        self._glb, self._reading = glb, reading
        self._pictures: dict[int, UInt8[np.ndarray, "h w 3"]] = {}

    def dressed(self, surface: Surface, primitive: Primitive) -> Surface:
        """The surface as its material and vertex colours have it."""
        factor, info = np.ones(3), None
        if primitive.material is not None:
            factor, info = _base(entry(self._glb.gltf.materials, primitive.material, "materials"))
        tints = self._vertex_colours(primitive, len(surface.vertices))
        if tints is not None:
            surface = coloured(surface, np.round(255 * _for_screen(factor * tints)).astype(np.uint8))
        elif primitive.material is not None:
            r, g, b = (float(c) for c in _for_screen(factor))
            surface = replace(surface, rgba=(r, g, b, 1.0))
        if info is None:
            return surface
        transform = _extension(TextureTransform, info.extensions.get(_TRANSFORM, {}))
        which = info.texCoord if transform.texCoord is None else transform.texCoord
        uv = self._coordinates(primitive, which, len(surface.vertices))
        if uv is None:
            self._reading.note("A texture without coordinates was left out.")
            return surface
        uv = _transformed(uv, transform)
        return textured(surface, uv, self._picture(info, uv))

    def _vertex_colours(self, primitive: Primitive, count: int) -> Float[np.ndarray, "n 3"] | None:
        if "COLOR_0" not in primitive.attributes:
            return None
        tints = self._glb.values(primitive.attributes["COLOR_0"], ("VEC3", "VEC4"))
        if tints.dtype.kind != "f" or len(tints) != count:
            raise GlbError(
                "vertex colours (COLOR_0) must be fractions, one per corner; leave them out with --no-textures"
            )
        return np.clip(np.nan_to_num(tints[:, :3]), 0.0, 1.0)

    def _coordinates(self, primitive: Primitive, which: int, count: int) -> Float[np.ndarray, "n 2"] | None:
        name = f"TEXCOORD_{which}"
        if name not in primitive.attributes:
            return None
        uv = self._glb.values(primitive.attributes[name], ("VEC2",)).astype(np.float64)
        if len(uv) != count:
            raise GlbError(f"{name} has {len(uv)} rows for {count} corners")
        return uv

    def _picture(self, info: TextureInfo, uv: Float[np.ndarray, "n 2"]) -> UInt8[np.ndarray, "h w 3"]:
        gltf = self._glb.gltf
        texture = entry(gltf.textures, info.index, "textures")
        source = texture.source
        if source is None:
            source = _extension(_Source, texture.extensions.get(_WEBP, {})).source
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
            self._pictures[source] = picture_of(data, self._reading.texture_px, self._reading.path)
        return self._pictures[source]


class _Source(BaseModel):
    """An extension that names another picture."""

    source: int | None = None


def _base(material: Material) -> tuple[Float[np.ndarray, "3"], TextureInfo | None]:
    """Base colour and its texture."""
    if _SPECULAR in material.extensions:
        older = _extension(SpecularGlossiness, material.extensions[_SPECULAR])
        return _unit(older.diffuseFactor), older.diffuseTexture
    rough = material.pbrMetallicRoughness
    return _unit(rough.baseColorFactor), rough.baseColorTexture


def _unit(factor: tuple[float, ...]) -> Float[np.ndarray, "3"]:
    return np.clip(factor[:3], 0.0, 1.0)


def _extension(schema: type[_Model], content: Any) -> _Model:
    try:
        return schema.model_validate(content)
    except ValidationError as error:
        why = explain_faults(error).splitlines()[0].strip()
        raise GlbError(f"an extension is not as it should be ({why})") from None


def _for_screen(linear: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Linear light to the values of sRGB (IEC 61966-2-1)."""
    bright = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.clip(np.where(linear <= 0.0031308, 12.92 * linear, bright), 0.0, 1.0).round(9)


def _transformed(uv: Float[np.ndarray, "n 2"], transform: TextureTransform) -> Float[np.ndarray, "n 2"]:
    """KHR_texture_transform: scaled, turned, moved. The turn is counter-clockwise where v points down, as viewers and
    the sample models have it; the matrix in the extension's text has the other sense."""
    c, s = np.cos(transform.rotation), np.sin(transform.rotation)
    return uv * transform.scale @ np.array([[c, -s], [s, c]]) + transform.offset
