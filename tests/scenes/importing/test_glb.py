"""GLB files as the standard and its extensions have them; what is not read is refused, never left out."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from glb_files import (
    FACES,
    SIZE,
    VERTICES,
    GlbBuilder,
    glb_of_box,
    is_white,
    notes_on,
    read_glb_file,
    read_one,
    textured_box,
)
from mesh_files import enclosed_volume, png, two_tone, write_glb

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces

VOLUME = 0.06 * 0.16 * 0.21


def test_a_box_is_the_box(tmp_path: Path) -> None:
    surface = read_one(glb_of_box(), tmp_path)
    np.testing.assert_allclose(surface.vertices[surface.faces], VERTICES[FACES], atol=1e-7)


@pytest.mark.parametrize(
    "node",
    [
        {"translation": [0.1, 0.2, 0.3], "rotation": [0.5, 0.5, 0.5, 0.5], "scale": [2, 2, 2]},
        {"matrix": [0, 2, 0, 0, 0, 0, 2, 0, 2, 0, 0, 0, 0.1, 0.2, 0.3, 1]},
    ],
)
def test_nodes_place_their_parts(node: dict[str, Any], tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["nodes"] = [node | {"children": [1]}, {"mesh": 0}]
    surface = read_one(builder, tmp_path)
    np.testing.assert_allclose(
        surface.vertices, 2 * np.roll(VERTICES, 1, axis=1) + (0.1, 0.2, 0.3), atol=1e-6
    )


@pytest.mark.parametrize("size", [1e-200, 5e-324, 1e-13, 1e308])
def test_turns_of_any_length_are_turns(size: float, tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["nodes"] = [{"mesh": 0, "rotation": [size] * 4}]
    np.testing.assert_allclose(read_one(builder, tmp_path).vertices, np.roll(VERTICES, 1, axis=1), atol=1e-6)
    builder.gltf["nodes"] = [{"mesh": 0, "rotation": [0, 0, 0, 0]}]
    np.testing.assert_allclose(read_one(builder, tmp_path).vertices, VERTICES, atol=1e-6)


@pytest.mark.parametrize("required", [[], ["KHR_node_visibility"]])
def test_hidden_nodes_and_those_below_them_are_left_out_and_told(required: list[str], tmp_path: Path) -> None:
    builder = glb_of_box()
    shown, hidden = ({"KHR_node_visibility": {"visible": on}} for on in (True, False))
    builder.gltf["nodes"] = [{"mesh": 0, "children": [1, 2], "extensions": {"KHR_node_visibility": {}}}]
    builder.gltf["nodes"] += [{"mesh": 0, "extensions": hidden, "children": [3]}, {"mesh": 0}]
    builder.gltf["nodes"] += [{"mesh": 0, "extensions": shown}]
    builder.gltf["extensionsRequired"] = required
    assert len(read_glb_file(builder, tmp_path)) == 2
    assert notes_on(builder, tmp_path) == [
        "Hidden nodes (KHR_node_visibility), and what is below them, were left out."
    ]


def test_parts_that_are_as_good_as_flat_are_no_obstacle(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["nodes"] = [{"mesh": 0, "rotation": [0.5] * 4, "scale": [5e-324, 1, 1]}]
    assert read_glb_file(builder, tmp_path)


def test_mirrored_parts_still_face_outwards(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["nodes"] = [{"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 0, "translation": [1, 0, 0]}]
    builder.gltf["scenes"] = [{"nodes": [0, 1]}]
    volumes = [enclosed_volume(s.vertices, s.faces) for s in read_glb_file(builder, tmp_path)]
    np.testing.assert_allclose(volumes, [VOLUME, VOLUME], rtol=1e-5)


def test_only_the_scene_that_is_shown_is_read(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["nodes"] = [{"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0]}]
    builder.gltf["scenes"], builder.gltf["scene"] = [{"nodes": [0]}, {"nodes": [1]}], 1
    assert read_one(builder, tmp_path).vertices[:, 0].min() > 0.9
    del builder.gltf["scenes"], builder.gltf["scene"]
    assert len(read_glb_file(builder, tmp_path)) == 2


@pytest.mark.parametrize("mode", [4, 5, 6, None])
def test_strips_and_fans_are_triangles(mode: int | None, tmp_path: Path) -> None:
    outline = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * 0.1
    vertices = np.c_[outline, np.zeros(4)]
    faces = {4: [0, 1, 2, 0, 2, 3], 5: [0, 1, 3, 2], 6: [0, 1, 2, 3], None: [0, 1, 2]}[mode]
    builder = GlbBuilder().shape(vertices, np.array(faces))
    if mode is not None:
        builder.primitive["mode"] = mode
    surface = read_one(builder, tmp_path)
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a) / 2
    assert (normals[:, 2] > 0).all()
    assert normals[:, 2].sum() == pytest.approx(0.005 if mode is None else 0.01)


def test_points_and_lines_are_passed_over(tmp_path: Path) -> None:
    builder = glb_of_box()
    for mode in (0, 1, 2, 3):
        builder.gltf["meshes"][0]["primitives"].append({**builder.primitive, "mode": mode})
    assert len(read_glb_file(builder, tmp_path)) == 1


@pytest.mark.parametrize(("kind", "most"), [("<i1", 127), ("<u1", 255), ("<i2", 32767), ("<u2", 65535)])
def test_normalised_corners_are_fractions(kind: str, most: int, tmp_path: Path) -> None:
    builder = GlbBuilder()
    corners = (VERTICES / np.abs(VERTICES).max(axis=0) > 0) * most
    padded = np.zeros((8, 4), kind)
    padded[:, :3] = corners
    builder.attribute("POSITION", padded, normalized=True)
    builder.gltf["accessors"][0]["type"] = "VEC3"
    builder.gltf["bufferViews"][0]["byteStride"] = padded.strides[0]
    builder.primitive["indices"] = builder.accessor(FACES.astype("<u2").reshape(-1))
    builder.gltf["extensionsRequired"] = ["KHR_mesh_quantization"]
    builder.gltf["nodes"] = [{"mesh": 0, "scale": list(SIZE)}]
    np.testing.assert_allclose(read_one(builder, tmp_path).vertices, (VERTICES > 0) * SIZE, atol=1e-6)


@pytest.mark.parametrize("from_zero", [False, True])
def test_sparse_corners_take_their_places(from_zero: bool, tmp_path: Path) -> None:
    rows = np.arange(8) if from_zero else np.array([1, 6])
    builder = GlbBuilder().shape(np.zeros((8, 3)) if from_zero else VERTICES, FACES)
    accessor = builder.gltf["accessors"][0]
    if from_zero:
        del accessor["bufferView"]
    moved = VERTICES[rows] + (0 if from_zero else 0.01)
    accessor["sparse"] = {
        "count": len(rows),
        "indices": {"bufferView": builder.view(rows.astype("<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": builder.view(moved.astype("<f4").tobytes())},
    }
    expected = VERTICES.copy()
    expected[rows] = moved
    np.testing.assert_allclose(read_one(builder, tmp_path).vertices, expected, atol=1e-6)


@pytest.mark.parametrize("of_node", [False, True])
def test_morph_targets_that_are_on_move_the_corners(of_node: bool, tmp_path: Path) -> None:
    builder = glb_of_box()
    targets = [{"POSITION": builder.accessor((VERTICES * k).astype("<f4"))} for k in (1, 5)]
    builder.primitive["targets"] = targets
    builder.gltf["meshes"][0]["weights"] = [0.0, 1.0] if of_node else [0.5, 0.0]
    if of_node:
        builder.gltf["nodes"][0]["weights"] = [0.5, 0.0]
    np.testing.assert_allclose(read_one(builder, tmp_path).vertices, 1.5 * VERTICES, atol=1e-6)


def test_corners_that_other_parts_use_are_not_unpacked(tmp_path: Path) -> None:
    builder = glb_of_box()
    many = {"componentType": 5126, "count": 9_000_000, "type": "VEC3"}
    kinds = {"POSITION": "VEC3", "COLOR_0": "VEC3", "TEXCOORD_0": "VEC2"}
    builder.gltf["accessors"] += [many | {"type": kind} for kind in kinds.values()]
    builder.primitive["attributes"] = {name: 2 + k for k, name in enumerate(kinds)}
    builder.material({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, png(two_tone(32)))
    builder.primitive["indices"] = builder.accessor(np.array([7, 5, 8_999_999, 5, 7, 2], "<u4"))
    builder.gltf["meshes"][0]["primitives"] *= 2
    surfaces = read_glb_file(builder, tmp_path)
    assert [s.vertices.shape for s in surfaces] == [(4, 3)] * 2
    np.testing.assert_array_equal(surfaces[0].faces, [[2, 1, 3], [1, 2, 0]])
    assert surfaces[0].uv is not None
    assert surfaces[0].uv.shape == (4, 2)


def test_what_parts_share_is_the_same_for_each(tmp_path: Path) -> None:
    builder = textured_box()
    builder.attribute("COLOR_0", np.linspace(0, 1, 24, dtype="<f4").reshape(8, 3))
    builder.primitive["targets"] = [{"POSITION": builder.accessor(VERTICES.astype("<f4"))}]
    builder.gltf["meshes"][0]["weights"] = [1.0]
    accessor = builder.gltf["accessors"][0]
    accessor["sparse"] = {
        "count": 2,
        "indices": {"bufferView": builder.view(b"\1\6"), "componentType": 5121},
        "values": {"bufferView": builder.view((0.5 * VERTICES[[1, 6]]).astype("<f4").tobytes())},
    }
    whole = read_one(builder, tmp_path)
    both = [builder.accessor(part.astype("<u2").reshape(-1)) for part in (FACES[:3], FACES[3:])]
    builder.gltf["meshes"][0]["primitives"] = [{**builder.primitive, "indices": k} for k in both]
    parts = read_glb_file(builder, tmp_path)
    assert len(parts[0].vertices) < len(VERTICES)
    for name in ("vertices", "uv", "colours"):
        corners = np.concatenate([getattr(s, name)[s.faces] for s in parts])
        np.testing.assert_allclose(corners, getattr(whole, name)[FACES])


@pytest.mark.parametrize("sparse", [False, True])
def test_numbers_that_are_unpacked_over_and_over_are_refused(
    sparse: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torc.scenes.importing.reading.gltf.glb.MAX_FILE_NUMBERS", 36 + 24 + 24 * 5)
    builder = glb_of_box()
    builder.primitive["targets"] = [{"POSITION": 0}] * (3 if sparse else 5)
    builder.gltf["meshes"][0]["weights"] = [1.0] * 6
    if sparse:  # is put together once, which counts once
        content = {"bufferView": builder.view(b"\0" * 12)}
        indices = content | {"componentType": 5121}
        builder.gltf["accessors"][0]["sparse"] = {"count": 1, "indices": indices, "values": content}
        builder.primitive["targets"] += [{"POSITION": 0}]
    assert read_one(builder, tmp_path).vertices.shape == (8, 3)
    builder.primitive["targets"] += [{"POSITION": 0}]
    with pytest.raises(InputError, match="its parts use more than 180 numbers; simplify it"):
        read_glb_file(builder, tmp_path)


def test_parts_without_triangles_count_as_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("torc.scenes.importing.reading.reader.MAX_PARTS", 3)
    builder = glb_of_box()
    empty = {**builder.primitive, "indices": builder.accessor(np.zeros(1, "<u2"))}
    builder.gltf["meshes"][0]["primitives"] += [empty] * 2
    assert len(read_glb_file(builder, tmp_path)) == 1
    builder.gltf["meshes"][0]["primitives"] += [empty]
    with pytest.raises(InputError, match="more than 3 parts"):
        read_glb_file(builder, tmp_path)


def test_accessors_that_nothing_uses_are_not_looked_at(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["accessors"] += [
        {"componentType": 5126, "count": 0, "type": "VEC3"},
        {"componentType": 5130, "count": 1, "type": "SCALAR"},
        {"componentType": 5126, "count": 1, "type": "ACME"},
    ]
    assert read_glb_file(builder, tmp_path)


@pytest.mark.parametrize("index", [0, 1])
def test_parts_that_are_compressed_alone_are_refused(index: int, tmp_path: Path) -> None:
    name = "KHR_draco_mesh_compression"
    builder = glb_of_box()
    builder.gltf["extensionsUsed"] = [name]
    builder.primitive["extensions"] = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}
    assert read_glb_file(builder, tmp_path)  # the same in plain is there
    del builder.gltf["accessors"][index]["bufferView"]
    with pytest.raises(
        InputError, match=r"a.glb is compressed \(KHR_draco.*Export it without compression\.$"
    ):
        read_glb_file(builder, tmp_path)


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
@pytest.mark.parametrize("buffer", [0, 1])
def test_buffer_views_that_are_compressed_alone_are_refused(name: str, buffer: int, tmp_path: Path) -> None:
    builder = glb_of_box()
    for view in builder.gltf["bufferViews"]:
        view["extensions"] = {name: {"buffer": 0, "byteLength": 8, "byteStride": 12, "count": 8}}
    assert read_glb_file(builder, tmp_path)
    path = builder.write(tmp_path / "a.glb")
    header = builder.gltf | {"buffers": [{"byteLength": 168}, {"byteLength": 168}]}
    builder.gltf["bufferViews"][0]["buffer"] = buffer
    header["buffers"][buffer]["extensions"] = {name: {"fallback": True}}
    write_glb(path, json.dumps(header), path.read_bytes()[-168:])
    with pytest.raises(
        InputError, match=rf"a.glb is compressed \({name}\).*Export it without compression\.$"
    ):
        read_surfaces(path, 1.0, False, tmp_path, 64)


def _with_chunks(builder: GlbBuilder, path: Path, *chunks: bytes) -> Path:
    """More chunks between the JSON and the binary one."""
    data = builder.write(path).read_bytes()
    at = 20 + int.from_bytes(data[12:16], "little")
    data = data[:at] + b"".join(chunks) + data[at:]
    path.write_bytes(data[:8] + struct.pack("<I", len(data)) + data[12:])
    return path


def test_chunks_of_other_kinds_are_passed_over(tmp_path: Path) -> None:
    other = struct.pack("<I4s4s", 4, b"ACME", b"\xff" * 4)
    path = _with_chunks(glb_of_box(), tmp_path / "a.glb", other, struct.pack("<I4s", 0, b"EMPT"))
    (surface,), _ = read_surfaces(path, 1.0, False, tmp_path, 64)
    np.testing.assert_allclose(surface.vertices, VERTICES, atol=1e-7)


def test_chunks_that_leave_the_file_are_refused(tmp_path: Path) -> None:
    path = _with_chunks(glb_of_box(), tmp_path / "a.glb", struct.pack("<I4s", 2**31, b"ACME"))
    with pytest.raises(InputError, match="it is cut off, a chunk of 2147483648 bytes"):
        read_surfaces(path, 1.0, False, tmp_path, 64)
    content = path.read_bytes()
    path.write_bytes(content[:16] + b"ACME" + content[20:])
    with pytest.raises(InputError, match="does not begin with JSON"):
        read_surfaces(path, 1.0, False, tmp_path, 64)


def test_null_is_as_good_as_nothing(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.material({"pbrMetallicRoughness": None, "extensions": None, "emissiveTexture": None})
    builder.gltf |= {"samplers": None, "scene": None}
    builder.gltf["nodes"][0] |= {"extensions": {"KHR_node_visibility": None}, "matrix": None, "scale": None}
    builder.primitive.update(extensions={"KHR_draco_mesh_compression": None}, targets=None)
    builder.gltf["accessors"][0] |= {"extensions": None, "sparse": None}
    assert is_white(read_one(builder, tmp_path))


def _require(name: str) -> Callable[[GlbBuilder], None]:
    return lambda builder: builder.gltf.__setitem__("extensionsRequired", [name])


def _at(path: tuple[Any, ...], value: Any) -> Callable[[GlbBuilder], None]:
    def change(builder: GlbBuilder) -> None:
        place: Any = builder.gltf
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_require("EXT_mesh_gpu_instancing"), "needs the extension EXT_mesh_gpu_instancing"),
        (_require("ACME_geometry"), "needs the extension ACME_geometry"),
        (_at(("nodes", 0, "extensions"), {"EXT_mesh_gpu_instancing": {}}), "stands for many copies"),
        (_at(("nodes", 0, "skin"), 0), "bent by a skeleton"),
        (_at(("nodes", 0, "children"), [0]), "below itself"),
        (_at(("nodes", 0, "mesh"), 7), r"meshes\[7\] is named, but is not there"),
        (_at(("nodes", 0, "scale"), [1, 1]), r"nodes\[0\].scale"),
        (_at(("nodes", 0, "scale"), [1, 1, float("nan")]), "finite number"),
        (_at(("nodes", 0, "scale"), [1, 1, 1e308]), r"nodes\[0\] is moved or scaled beyond all measure"),
        (_at(("nodes", 0, "matrix"), [1e308] * 16), r"nodes\[0\] is moved or scaled beyond all measure"),
        (_at(("nodes", 0, "extensions"), {"KHR_node_visibility": 3}), r"KHR_node_visibility of nodes\[0\]"),
        (_at(("scenes", 0, "nodes"), [5]), r"nodes\[5\]"),
        (_at(("scene",), 3), r"scenes\[3\]"),
        (_at(("meshes", 0, "primitives", 0, "mode"), 9), "mode"),
        (_at(("meshes", 0, "primitives", 0, "attributes"), {}), "no POSITION"),
        (_at(("meshes", 0, "primitives", 0, "indices"), 0), "VEC3, not SCALAR"),
        (_at(("accessors", 0, "count"), 9), "needs more than the 96 bytes"),
        (_at(("accessors", 0, "count"), 7), "beyond the 7"),
        (_at(("accessors", 0, "count"), 10**12), "count"),
        (_at(("accessors", 0, "componentType"), 5130), "componentType"),
        (_at(("accessors", 0, "count"), 0), r"accessors\[0\] is not as it should be \(count"),
        (_at(("accessors", 0), None), r"accessors\[0\] is not as it should be"),
        (_at(("accessors", 0, "byteOffset"), -4), "byteOffset"),
        (_at(("accessors", 0, "bufferView"), 99), r"bufferViews\[99\]"),
        (_at(("accessors", 0, "type"), "MAT3"), "MAT3, not VEC3"),
        (_at(("bufferViews", 0, "byteLength"), 10**7), r"bufferViews\[0\] leaves its buffer"),
        (_at(("bufferViews", 0, "byteStride"), 8), "needs more than"),
        (_at(("bufferViews", 0, "buffer"), 1), r"buffers\[1\]"),
    ],
)
def test_what_is_not_read_or_not_right_is_refused(
    change: Callable[[GlbBuilder], None], message: str, tmp_path: Path
) -> None:
    builder = glb_of_box()
    change(builder)
    with pytest.raises(InputError, match=message):
        read_glb_file(builder, tmp_path)


def test_a_buffer_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    builder = glb_of_box()
    path = builder.write(tmp_path / "a.glb")
    content = path.read_bytes()
    path.write_bytes(content.replace(b'"byteLength": 168}]', b'"byteLength": 999}]'))
    assert path.read_bytes() != content
    with pytest.raises(InputError, match="168 bytes of 999: it is cut off"):
        read_surfaces(path, 1.0, False, tmp_path, 64)


def test_an_older_version_is_told_as_that(tmp_path: Path) -> None:
    path = glb_of_box().write(tmp_path / "a.glb")
    content = bytearray(path.read_bytes())
    content[4] = 1
    path.write_bytes(content)
    with pytest.raises(InputError, match="is glTF 1"):
        read_surfaces(path, 1.0, False, tmp_path, 64)
