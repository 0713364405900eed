"""A mesh file to clean surfaces and one welded net for contact, as files: the child process's side, and the reading
of its answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from pydantic import TypeAdapter, ValidationError

from torc.errors import InputError
from torc.files.reading import ArraySpec, read_arrays
from torc.scenes.importing.closing import Net, closed_net
from torc.scenes.importing.reading import read_surfaces
from torc.scenes.importing.simplifying import baked, simplified
from torc.scenes.importing.slivers import without_slivers
from torc.scenes.importing.surfaces import Surface, welded, with_area, with_normals, with_sound_faces
from torc.scenes.importing.texture_sizes import fitting_textures
from torc.scenes.models import VisualMesh
from torc.scenes.object_checks import visible_area_m2
from torc.scenes.object_schema import MAX_SIZE_M, MAX_TEXTURE_PIXELS, MAX_VISUALS, MIN_SIZE_M, VisualEntry
from torc.scenes.visual_files import read_visuals, save_textures, visual_arrays, visual_entries, visual_specs

MAX_CONTACT_FACES = 4_000
"""Enough for contact; the decomposition's time grows with them."""
MAX_READ_FACES = 40_000
"""Where simplification does not get that far, e.g. thousands of loose triangles."""
ARRAYS_FILE = "arrays.npz"
_MAX_ARRAY_BYTES = 128 * 2**20
CONTACT_SPECS = {
    "contact_vertices": ArraySpec("f", 3, 3 * MAX_READ_FACES),
    "contact_faces": ArraySpec("i", 3, MAX_READ_FACES),
}


@dataclass(frozen=True, eq=False)
class PreparedMesh:
    """What was read out of a mesh file: metres, z up, in the file's own frame.

    Attributes:
        visuals: surfaces to look at.
        vertices, faces: the welded net for contact.
        closed: it has an inside.
        notes: what was done to the mesh, for its owner.
    """

    visuals: tuple[VisualMesh, ...]
    vertices: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    closed: bool
    notes: tuple[str, ...]


def prepare(request: Mapping[str, Any], directory: Path) -> dict[str, Any]:
    """Reads request["path"] and leaves what it holds in `directory`: the child process's task.

    Raises:
        InputError: not readable, without triangles, or of an absurd size.
    """
    path = Path(request["path"])
    scale, texture_px = float(request["scale"]), int(request["texture_px"])
    root = Path(request["root"] or path.parent) if request["textures"] else None
    surfaces, notes = read_surfaces(path, scale, bool(request["y_up"]), root, texture_px)
    sound, dropped = _sound(surfaces, path)
    if dropped:
        notes.append(f"{dropped} unusable triangles were left out (not finite, or double).")
    _check_size(sound, path, scale)
    surfaces = _visible([with_area(s) for s in sound], path, notes)
    net, whole = _net(sound)
    if len(net.faces) > MAX_READ_FACES:
        raise InputError(
            f"{path} cannot be simplified below {MAX_READ_FACES} triangles: it is torn into pieces."
        )
    visuals = _visuals(surfaces, net, whole, int(request["max_faces"]), texture_px, notes)
    _note_net(net, notes)
    arrays = {
        **visual_arrays(visuals),
        "contact_vertices": net.vertices,
        "contact_faces": net.faces.astype(np.int32),
    }
    np.savez(directory / ARRAYS_FILE, **arrays)  # type: ignore[arg-type]
    save_textures(visuals, directory)
    return {"visuals": visual_entries(visuals), "closed": net.closed, "notes": notes}


def read_prepared(answer: Mapping[str, Any], directory: Path) -> PreparedMesh:
    """The child's answer, validated. Raises InputError if it is not what it should be."""
    try:
        entries = TypeAdapter(list[VisualEntry]).validate_python(answer.get("visuals"))
        notes = TypeAdapter(list[str]).validate_python(answer.get("notes"))
        closed = TypeAdapter(bool).validate_python(answer.get("closed"))
    except ValidationError as error:
        raise InputError(f"Reading the mesh gave no usable answer: {error.error_count()} faults.") from None
    if not 0 < len(entries) <= MAX_VISUALS:
        raise InputError(f"Reading the mesh gave {len(entries)} surfaces.")
    arrays = read_arrays(
        directory / ARRAYS_FILE,
        {**visual_specs(entries), **CONTACT_SPECS},
        _MAX_ARRAY_BYTES,
        "the mesh as read",
    )
    vertices, faces = arrays["contact_vertices"], arrays["contact_faces"]
    if faces.max() >= len(vertices):
        raise InputError("Reading the mesh gave triangles without corners.")
    told = tuple("".join(c if c.isprintable() else "?" for c in note)[:300] for note in notes[:20])
    return PreparedMesh(read_visuals(entries, arrays, directory), vertices, faces, closed, told)


def _sound(surfaces: Sequence[Surface], path: Path) -> tuple[list[Surface], int]:
    found, dropped = [], 0
    for surface in surfaces:
        good, bad = with_sound_faces(surface)
        dropped += bad
        if len(good.faces):
            found.append(good)
    if not found:
        raise InputError(f"{path} holds no usable triangles: all {dropped} are not finite.")
    return found, dropped


def _check_size(surfaces: Sequence[Surface], path: Path, scale: float) -> None:
    low = np.min([s.vertices.min(axis=0) for s in surfaces], axis=0)
    high = np.max([s.vertices.max(axis=0) for s in surfaces], axis=0)
    extent = high - low
    largest = float(extent.max())
    if largest > MAX_SIZE_M:
        raise InputError(
            f"{path} is {_length(largest)} large; at most {MAX_SIZE_M:g} m. {_scale_hint(largest, scale)}"
        )
    if largest < 2 * MIN_SIZE_M:
        raise InputError(f"{path} is only {_length(largest)} large. {_scale_hint(largest, scale)}")
    if float(extent.min()) < MIN_SIZE_M:
        raise InputError(
            f"{path} is {_length(float(extent.min()))} thin; things thinner than {1000 * MIN_SIZE_M:g} mm slip through "
            "contacts. Give it a thickness first."
        )


def _visible(surfaces: Sequence[Surface], path: Path, notes: list[str]) -> list[Surface]:
    """Those that the physics takes for surfaces."""
    found = [s for s in surfaces if visible_area_m2(s.vertices, s.faces) > 0.0]
    if not found:
        raise InputError(f"{path} has next to no area: its triangles are points or lines.")
    if len(found) < len(surfaces):
        notes.append(f"Parts that are but points or lines were left out ({len(surfaces) - len(found)}).")
    return found


def _length(metres: float) -> str:
    if metres >= 1.0:
        return f"{metres:.4g} m"
    return f"{1000 * metres:.3g} mm"


def _scale_hint(largest: float, scale: float) -> str:
    """The scale that would make it a thing for a table, if there is one."""
    units = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254, "decimetres": 0.1}
    for unit, factor in units.items():
        if 0.02 <= largest * factor <= 0.6:
            words = f"It looks like {unit}: use" if scale == 1.0 else "Use"
            return f"{words} --scale {factor * scale:g}."
    for factor in (10.0, 100.0, 1000.0):
        if 0.02 <= largest * factor <= 0.6:
            return f"Use --scale {factor * scale:g} if it is meant to be larger."
    return "Use --scale to give the metres per unit of the file."


def _net(surfaces: Sequence[Surface]) -> tuple[Net, tuple[np.ndarray, np.ndarray]]:
    """The net for contact, and the same with all triangles."""
    offsets = np.cumsum([0, *(len(s.vertices) for s in surfaces)])
    vertices = np.concatenate([s.vertices for s in surfaces])
    faces = np.concatenate([s.faces + o for s, o in zip(surfaces, offsets)])
    whole = welded(vertices, faces)
    whole = whole[0], without_slivers(*whole)
    return closed_net(*simplified(*whole, MAX_CONTACT_FACES)), whole


def _visuals(
    surfaces: list[Surface],
    net: Net,
    whole: tuple[np.ndarray, np.ndarray],
    max_faces: int,
    texture_px: int,
    notes: list[str],
) -> list[VisualMesh]:
    # Only closed surfaces that face outwards can be drawn from one side.
    two_sided = not net.closed or net.closed_holes > 0
    allowed = max_faces // 2 if two_sided else max_faces
    count = sum(len(s.faces) for s in surfaces)
    if net.turned:
        surfaces = [_turned(s) for s in surfaces]
    plain = len({s.rgba for s in surfaces}) == 1 and all(
        s.texture is None and s.colours is None for s in surfaces
    )
    coloured = any(s.colours is not None for s in surfaces)
    if count <= allowed and not coloured and len(surfaces) <= MAX_VISUALS // 2:
        visuals = [_visual(s) for s in surfaces]
    else:
        faces = whole[1][:, ::-1] if net.turned else whole[1]
        vertices, faces = simplified(whole[0], faces, allowed)
        if count > len(faces):
            notes.append(f"To look at, {count} triangles were simplified to {len(faces)}.")
        if plain:
            visuals = [_visual(Surface(vertices, faces, rgba=surfaces[0].rgba))]
        else:
            visuals = [baked(surfaces, vertices, faces, texture_px)]
            notes.append("Its colours were put into one new texture.")
    if two_sided:
        visuals = [v for visual in visuals for v in (visual, _back(visual))]
    visuals, factor = fitting_textures(visuals, MAX_TEXTURE_PIXELS)
    if factor < 1.0:
        notes.append(f"Its textures are many and large: they were scaled down to {100 * factor:.0f} %.")
    return visuals


def _turned(surface: Surface) -> Surface:
    return replace(surface, faces=surface.faces[:, ::-1])


def _visual(surface: Surface) -> VisualMesh:
    split, normals = with_normals(surface)
    return VisualMesh(split.vertices, split.faces, split.uv, split.texture, split.rgba, normals)


def _back(visual: VisualMesh) -> VisualMesh:
    """The other side of a surface."""
    normals = None if visual.normals is None else -visual.normals
    return replace(visual, faces=visual.faces[:, ::-1], normals=normals)


def _note_net(net: Net, notes: list[str]) -> None:
    if net.turned:
        notes.append("Its triangles faced inwards; they were turned.")
    if net.closed_holes:
        notes.append(f"{net.closed_holes} holes were closed.")
    if not net.closed:
        notes.append("It is not watertight: open parts are touched as a shell around their surface.")
