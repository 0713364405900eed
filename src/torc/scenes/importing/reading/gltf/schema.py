"""What of a glTF 2.0 file's JSON is read (Khronos, glTF 2.0 Specification, chapter 5).

Other fields are passed over, and those that are null. `refusal` tells which extensions a file cannot be understood
without.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from torc.scenes.importing.reading.limits import MAX_FILE_VERTICES

Index = Annotated[int, Field(ge=0)]
_Vec2 = tuple[float, float]
_Vec4 = tuple[float, float, float, float]
_COMPRESSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
_HARMLESS = (
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_lights_punctual",
    "KHR_xmp_json_ld",
    "KHR_animation_pointer",
)
"""Of the geometry: read as it is, or nothing that is looked at here."""
_OF_MATERIALS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_")
"""Prefixes: at worst a picture is missing, which is told where it is needed."""


def _without_nulls(content: Any) -> Any:
    """Some exporters write null for what is not there."""
    if isinstance(content, dict) and None in content.values():
        return {name: value for name, value in content.items() if value is not None}
    return content


class _Object(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)
    _tidied = model_validator(mode="before")(_without_nulls)


class _Entry(_Object):
    extensions: Annotated[dict[str, Any], BeforeValidator(_without_nulls)] = {}


class Buffer(_Entry):
    byteLength: Index
    uri: str | None = None


class Fallback(_Object):
    """EXT_meshopt_compression of a buffer: true if it holds the place of what is unpacked."""

    fallback: bool = False


class BufferView(_Entry):
    buffer: Index
    byteOffset: Index = 0
    byteLength: Index
    byteStride: Annotated[int, Field(ge=1, le=252)] | None = None


class SparseIndices(_Entry):
    bufferView: Index
    byteOffset: Index = 0
    componentType: Literal[5121, 5123, 5125]


class SparseValues(_Entry):
    bufferView: Index
    byteOffset: Index = 0


class Sparse(_Entry):
    count: Annotated[int, Field(ge=1, le=MAX_FILE_VERTICES)]
    indices: SparseIndices
    values: SparseValues


class Accessor(_Entry):
    bufferView: Index | None = None
    byteOffset: Index = 0
    componentType: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    normalized: bool = False
    count: Annotated[int, Field(ge=1, le=MAX_FILE_VERTICES)]
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    sparse: Sparse | None = None


class Primitive(_Entry):
    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Annotated[int, Field(ge=0, le=6)] = 4
    targets: list[dict[str, Index]] = []


class Mesh(_Entry):
    primitives: list[Primitive]
    weights: list[float] = []


class Node(_Entry):
    children: list[Index] = []
    mesh: Index | None = None
    skin: Index | None = None
    weights: list[float] | None = None
    matrix: Annotated[list[float], Field(min_length=16, max_length=16)] | None = None
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: _Vec4 = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


class SceneEntry(_Entry):
    nodes: list[Index] = []


class Visibility(_Object):
    """KHR_node_visibility."""

    visible: bool = True


class TextureTransform(_Object):
    """KHR_texture_transform."""

    offset: _Vec2 = (0.0, 0.0)
    rotation: float = 0.0
    scale: _Vec2 = (1.0, 1.0)
    texCoord: Index | None = None


class TextureInfo(_Entry):
    index: Index
    texCoord: Index = 0


class MetallicRoughness(_Entry):
    baseColorFactor: _Vec4 = (1.0, 1.0, 1.0, 1.0)
    baseColorTexture: TextureInfo | None = None


class SpecularGlossiness(_Object):
    """KHR_materials_pbrSpecularGlossiness, which older files have in place of the above."""

    diffuseFactor: _Vec4 = (1.0, 1.0, 1.0, 1.0)
    diffuseTexture: TextureInfo | None = None


class Material(_Entry):
    pbrMetallicRoughness: MetallicRoughness = MetallicRoughness()
    emissiveFactor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emissiveTexture: TextureInfo | None = None
    alphaMode: str = "OPAQUE"


class Texture(_Entry):
    source: Index | None = None
    sampler: Index | None = None


class Sampler(_Entry):
    wrapS: int = 10497
    wrapT: int = 10497


class ImageEntry(_Entry):
    uri: str | None = None
    bufferView: Index | None = None


class Gltf(_Object):
    extensionsRequired: list[str] = []
    buffers: list[Buffer] = []
    bufferViews: list[BufferView] = []
    accessors: list[Any] = []  # each is looked at where it is used; exporters leave odd ones that are not
    meshes: list[Mesh] = []
    nodes: list[Node] = []
    scenes: list[SceneEntry] = []
    scene: Index | None = None
    materials: list[Material] = []
    textures: list[Texture] = []
    samplers: list[Sampler] = []
    images: list[ImageEntry] = []


def refusal(gltf: Gltf) -> str | None:
    """Why a file that cannot be understood without its extensions is not read; None if it can."""
    for name in gltf.extensionsRequired:
        if name in _COMPRESSIONS:
            return compressed(name)
        if name not in _HARMLESS and not name.startswith(_OF_MATERIALS):
            return f"needs the extension {name[:80]}, which is not read. Export it without."
    return None


def compression(extensions: dict[str, Any]) -> str | None:
    """The extension that compresses an entry's data; None if they are plain."""
    return next((name for name in _COMPRESSIONS if name in extensions), None)


def compressed(name: str) -> str:
    """The end of a sentence on a file that has no data but such as an extension compressed."""
    return f"is compressed ({name}), which is not read. Export it without compression."
