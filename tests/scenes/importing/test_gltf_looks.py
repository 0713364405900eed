"""Colours and textures of GLB files; what is not shown as the file has it is told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from glb_files import (
    UV,
    VERTICES,
    glb_of_box,
    is_white,
    notes_on,
    read_glb_file,
    read_one,
    textured_box,
)
from mesh_files import png, two_tone
from PIL import Image

from torc.errors import InputError
from torc.scenes.importing.reading import read_surfaces


def test_extensions_of_looks_are_no_obstacle(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.gltf["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform", "KHR_xmp_json_ld"]
    assert read_one(builder, tmp_path).rgba == (0.72, 0.72, 0.74, 1.0)


def test_a_material_without_colours_is_white(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.material({})
    assert is_white(read_one(builder, tmp_path))


def test_base_colours_are_linear_light(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.material({"pbrMetallicRoughness": {"baseColorFactor": [0.2140, 0.0, 1.0, 0.5]}})
    assert read_one(builder, tmp_path).rgba == pytest.approx((0.5, 0.0, 1.0, 1.0), abs=1e-3)


@pytest.mark.parametrize("kind", ["<f4", "<u1", "<u2"])
@pytest.mark.parametrize("channels", [3, 4])
def test_vertex_colours_are_linear_and_multiply_the_material(
    kind: str, channels: int, tmp_path: Path
) -> None:
    builder = glb_of_box()
    most = 1.0 if kind == "<f4" else float(np.iinfo(kind).max)
    share = np.where(VERTICES[:, [2]] > 0, 1.0, 0.2140) * np.ones(channels)
    builder.attribute("COLOR_0", np.round(most * share, 0 if most > 1 else 6).astype(kind), most > 1)
    builder.material({"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.5, 0.0, 1.0]}})
    surface = read_one(builder, tmp_path)
    assert surface.colours is not None
    high = surface.vertices[:, 2] > 0
    np.testing.assert_allclose(surface.colours[high], np.tile((255, 188, 0), (4, 1)), atol=1)
    np.testing.assert_allclose(surface.colours[~high], np.tile((128, 92, 0), (4, 1)), atol=2)


def test_one_vertex_colour_for_all_is_a_colour(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.attribute("COLOR_0", np.ones((8, 4), "<f4"))
    assert is_white(read_one(builder, tmp_path))


def test_vertex_colours_that_are_no_fractions_are_refused(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.attribute("COLOR_0", np.full((8, 4), 255, "<u1"))
    with pytest.raises(InputError, match="COLOR_0"):
        read_glb_file(builder, tmp_path)
    assert read_glb_file(builder, tmp_path, textures=False)


def test_textures_and_vertex_colours_both_show(tmp_path: Path) -> None:
    builder = textured_box()
    builder.attribute("COLOR_0", np.linspace(0, 1, 24, dtype="<f4").reshape(8, 3))
    surface = read_one(builder, tmp_path)
    assert surface.texture is not None
    assert surface.colours is not None


@pytest.mark.parametrize("kind", ["<u1", "<u2"])
def test_normalised_texture_coordinates_are_fractions(kind: str, tmp_path: Path) -> None:
    uv = np.round(UV * np.iinfo(kind).max).astype(kind)
    surface = read_one(textured_box(uv=uv), tmp_path)
    assert surface.uv is not None
    np.testing.assert_allclose(surface.uv, UV, atol=0.01)


def test_coordinates_beyond_all_measure_are_made_harmless(tmp_path: Path) -> None:
    builder = textured_box({"extensions": {"KHR_texture_transform": {"scale": [1e308, -1e308]}}}, uv=9 * UV)
    uv = read_one(builder, tmp_path).uv
    assert uv is not None
    assert np.isfinite(uv).all()


@pytest.mark.parametrize("weight", [1e308, -1e308])
def test_corners_that_are_not_finite_are_no_obstacle(weight: float, tmp_path: Path) -> None:
    builder = glb_of_box()
    huge = np.full((8, 3), 3e38, "<f4")
    huge[0] = np.inf
    huge[1:2].view("<u4")[:] = 0x7F800001  # a NaN of the kind that signals
    builder.primitive["targets"] = [{"POSITION": builder.accessor(huge)}]
    builder.gltf["meshes"][0]["weights"] = [weight]
    assert not np.isfinite(read_one(builder, tmp_path).vertices).any()


def test_the_set_of_coordinates_that_is_named_is_used(tmp_path: Path) -> None:
    builder = textured_box({"texCoord": 1})
    builder.attribute("TEXCOORD_1", UV[::-1].copy())
    surface = read_one(builder, tmp_path)
    assert surface.uv is not None
    np.testing.assert_allclose(surface.uv, UV[::-1])
    transform = {"KHR_texture_transform": {"texCoord": 0}}
    builder.gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = transform
    surface = read_one(builder, tmp_path)
    assert surface.uv is not None
    np.testing.assert_allclose(surface.uv, UV)


def test_texture_transforms_scale_turn_and_move(tmp_path: Path) -> None:
    transform = {"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2.0, 3.0]}
    surface = read_one(textured_box({"extensions": {"KHR_texture_transform": transform}}), tmp_path)
    assert surface.uv is not None
    # A quarter turn takes u's axis to where v points up: (u, v) to (v, -u).
    expected = np.stack([3 * UV[:, 1] + 0.5, -2 * UV[:, 0] + 0.25], axis=1)
    np.testing.assert_allclose(surface.uv, expected, atol=1e-6)


def test_older_materials_have_their_colours_elsewhere(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.attribute("TEXCOORD_0", UV)
    older = {"diffuseFactor": [1.0, 0.2140, 0.0, 1.0], "diffuseTexture": {"index": 0}}
    builder.material({"extensions": {"KHR_materials_pbrSpecularGlossiness": older}}, png(two_tone(32)))
    surface = read_one(builder, tmp_path)
    assert surface.rgba == pytest.approx((1.0, 0.5, 0.0, 1.0), abs=1e-3)
    assert surface.texture is not None
    assert surface.texture.shape == (32, 32, 3)


def test_webp_is_read_and_what_is_not_read_is_refused(tmp_path: Path) -> None:
    builder = textured_box()
    builder.gltf["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    assert read_one(builder, tmp_path).texture is not None
    builder.gltf["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    with pytest.raises(InputError, match=r"no picture that is read \(KHR_texture_basisu\)"):
        read_glb_file(builder, tmp_path)
    assert read_glb_file(builder, tmp_path, textures=False)


def test_every_bad_texture_is_refused_not_only_the_first(tmp_path: Path) -> None:
    builder = textured_box()
    second = {**builder.primitive, "material": 1}
    builder.gltf["meshes"][0]["primitives"].append(second)
    builder.gltf["materials"].append({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}})
    broken = png(Image.new("RGB", (8, 8)))[:40]
    builder.gltf["images"].append({"bufferView": builder.view(broken)})
    builder.gltf["textures"].append({"source": 1})
    with pytest.raises(InputError, match="texture cannot be used"):
        read_glb_file(builder, tmp_path)


def test_what_cannot_be_shown_exactly_is_told(tmp_path: Path) -> None:
    builder = textured_box(uv=3 * UV)
    builder.gltf["samplers"] = [{"wrapS": 33071}]
    builder.gltf["textures"][0]["sampler"] = 0
    path = builder.write(tmp_path / "a.glb")
    assert "clamped" in read_surfaces(path, 1.0, False, tmp_path, 64)[1][0]
    path = textured_box({"texCoord": 2}).write(tmp_path / "b.glb")
    surfaces, notes = read_surfaces(path, 1.0, False, tmp_path, 64)
    assert surfaces[0].texture is None
    assert notes == ["A texture without coordinates was left out."]


def test_what_is_black_but_gives_off_light_has_that_light_as_its_colour(tmp_path: Path) -> None:
    black = {"baseColorFactor": [0, 0, 0, 1]}
    glowing = {"pbrMetallicRoughness": black, "emissiveFactor": [1.0, 0.2140, 0.0]}
    builder = glb_of_box()
    builder.attribute("COLOR_0", np.linspace(0, 1, 24, dtype="<f4").reshape(8, 3))  # they tint the base alone
    builder.material(glowing)
    surface = read_one(builder, tmp_path)
    assert surface.rgba == pytest.approx((1.0, 0.5, 0.0, 1.0), abs=1e-3)
    assert surface.colours is None
    assert not notes_on(builder, tmp_path)
    builder = textured_box()
    builder.gltf["materials"] = [glowing | {"emissiveTexture": {"index": 0}}]
    surface = read_one(builder, tmp_path)
    assert surface.rgba == pytest.approx((1.0, 0.5, 0.0, 1.0), abs=1e-3)
    assert surface.texture is not None


def test_other_light_that_parts_give_off_is_told(tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.material({"emissiveFactor": [1.0, 1.0, 0.0]})
    assert is_white(read_one(builder, tmp_path))
    assert notes_on(builder, tmp_path) == ["Light that parts give off is not shown."]
    builder.gltf["materials"][0]["extensions"] = {"KHR_materials_unlit": {}}  # of which the standard has none
    assert not notes_on(builder, tmp_path)


@pytest.mark.parametrize(
    ("material", "told"),
    [
        ({"alphaMode": "BLEND"}, True),
        ({"alphaMode": "MASK"}, True),
        ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.0}}}, True),
        ({"alphaMode": "OPAQUE", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}, False),
    ],
)
def test_transparency_is_told(material: dict[str, Any], told: bool, tmp_path: Path) -> None:
    builder = glb_of_box()
    builder.material(material)
    builder.gltf["meshes"][0]["primitives"] *= 2
    assert notes_on(builder, tmp_path) == (["Transparent parts are shown opaque."] if told else [])
