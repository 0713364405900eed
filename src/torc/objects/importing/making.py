"""Convert a mesh file to an object in the format `torc-object/1`, as a child process with limits of time and memory.

It receives a directory with the request, and leaves its answer and the object there; never pickles.
"""

import contextlib
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float

from torc.errors import InputError
from torc.geometry.transforms import wxyz_from_rotation
from torc.io.digests import file_fingerprint
from torc.objects.importing.baking import baked
from torc.objects.importing.decomposing import convex_pieces, few_corners, solid_enough
from torc.objects.importing.mesh import ANSWER_FILE, MADE_DIRECTORY, REQUEST_FILE, MeshOptions
from torc.objects.importing.reading import Y_UP, read_surfaces
from torc.objects.importing.resting import is_round, resting_rotation
from torc.objects.importing.surfaces import (
    Solid,
    Surface,
    shaded,
    simplified,
    solid,
    sound,
    welded,
    with_area,
)
from torc.objects.models import CollisionPiece, ObjectModel, Vec3, VisualMesh, pieces_bounds
from torc.objects.object_files import save_object
from torc.objects.schema import MAX_MASS_KG, MAX_SIZE_M, MAX_VISUALS, MIN_MASS_KG, MIN_SIZE_M, ObjectSource

MAX_FACES = 20_000
"""Limit for visible meshes: those with more are simplified, their colours baked into a new texture."""
_TEXTURE_PX = 1024
"""Longest side of a texture."""
_MAX_PIECES = 24
_CONCAVITY = 0.05
"""How deep a hollow may be that contact pieces ignore, relative to the object's size (CoACD's threshold)."""
_MAX_CONTACT_FACES = 4_000
"""Enough for contact; the decomposition's time grows with them."""
_UNITS = (0.001, 0.01, 0.0254, 0.1, 10.0, 100.0, 1000.0)
"""Factors by which a scale may be off: millimetres, centimetres, inches, or the reverse."""
_MAX_FILE_BYTES = 2**30


def make_object(request: Mapping[str, Any], directory: Path) -> list[str]:
    """Convert the file request["path"] by the `MeshOptions` request["options"], and leave the object in `directory`.

    Returns notes on what was done to the mesh. request["undecomposed"] is a reason to use the convex hull instead of
    decomposing, or None. Raises InputError for a file that is not readable, without triangles, of an absurd size or
    mass, or flat.
    """
    path, given = Path(request["path"]), dict(request["options"])
    options = MeshOptions(**{**given, "root": None if given["root"] is None else Path(given["root"])})
    y_up = options.up == "y" or (options.up == "auto" and path.suffix.lower() == ".glb")
    root = (options.root or path.parent) if options.textures else None
    surfaces, notes = read_surfaces(path, options.scale, y_up, root, _TEXTURE_PX)
    surfaces = _sound(surfaces, path, notes)
    _check_size(surfaces, path, options.scale)
    whole = welded(*trimesh.util.append_faces([s.vertices for s in surfaces], [s.faces for s in surfaces]))
    contact = solid(simplified(whole, _MAX_CONTACT_FACES))
    visible = [s for s in map(with_area, surfaces) if len(s.faces)]
    if not visible:
        raise InputError(f"{path} has next to no area: its triangles are points or lines.")
    if len(visible) < len(surfaces):
        notes.append(f"Parts that are but points or lines were left out ({len(surfaces) - len(visible)}).")
    visuals = _visuals(visible, contact, whole, notes)
    notes += ["Its triangles faced inwards; they were turned."] if contact.turned else []
    notes += [f"{contact.closed_holes} holes were closed."] if contact.closed_holes else []
    if not contact.closed:
        notes.append("It is not watertight: open parts are touched as a shell around their surface.")
    hulls = _hulls(contact.net, path, request["undecomposed"], notes)
    model, source = _assembled(path, options, visuals, few_corners(hulls), y_up, notes)
    save_object(model, directory / MADE_DIRECTORY / model.name, source, overwrite=True)
    return notes


def _sound(surfaces: Sequence[Surface], path: Path, notes: list[str]) -> list[Surface]:
    found = [surface for surface in map(sound, surfaces) if len(surface.faces)]
    dropped = sum(len(s.faces) for s in surfaces) - sum(len(s.faces) for s in found)
    if not found:
        raise InputError(f"{path} holds no usable triangles: all {dropped} are not finite.")
    if dropped:
        notes.append(f"{dropped} unusable triangles were left out (not finite, or without corners).")
    return found


def _check_size(surfaces: Sequence[Surface], path: Path, scale: float) -> None:
    extent = np.ptp(np.concatenate([s.vertices for s in surfaces]), axis=0)
    largest = float(extent.max())
    if not 2 * MIN_SIZE_M <= largest <= MAX_SIZE_M:
        remedy = "Give the metres per unit of the file with --scale."
        if fitting := [f for f in _UNITS if 0.02 <= f * largest <= 0.6]:
            remedy = f"With --scale {fitting[0] * scale:g} it would be {_length(fitting[0] * largest)}."
        raise InputError(
            f"{path} is {_length(largest)} large; possible are {_length(2 * MIN_SIZE_M)} to {MAX_SIZE_M:g} m. {remedy}"
        )


def _length(metres: float) -> str:
    return f"{metres:.4g} m" if metres >= 1.0 else f"{1000 * metres:.3g} mm"


def _visuals(
    surfaces: list[Surface], contact: Solid, whole: trimesh.Trimesh, notes: list[str]
) -> tuple[VisualMesh, ...]:
    # Only closed surfaces that face outwards can be drawn from one side.
    two_sided = not contact.closed or contact.closed_holes > 0
    allowed = MAX_FACES // 2 if two_sided else MAX_FACES
    count = sum(len(s.faces) for s in surfaces)
    if contact.turned:
        surfaces = [replace(s, faces=s.faces[:, ::-1]) for s in surfaces]
    rgba = surfaces[0].rgba
    painted = any(s.texture is not None or s.colors is not None or s.rgba != rgba for s in surfaces)
    if count <= allowed and len(surfaces) <= MAX_VISUALS // 2 and all(s.colors is None for s in surfaces):
        visuals = [shaded(s) for s in surfaces]
    else:
        net = simplified(whole, allowed)
        faces = net.faces[:, ::-1] if contact.turned else net.faces
        fewer = with_area(Surface(np.array(net.vertices), np.array(faces), rgba=rgba))
        if count > len(fewer.faces):
            notes.append(f"To look at, {count} triangles were simplified to {len(fewer.faces)}.")
        if painted:
            notes.append("Its colours were put into one new texture.")
        visuals = [baked(surfaces, fewer, _TEXTURE_PX) if painted else shaded(fewer)]
    if two_sided:
        visuals = [side for visual in visuals for side in (visual, _back(visual))]
    return tuple(visuals)


def _back(visual: VisualMesh) -> VisualMesh:
    assert visual.normals is not None
    return replace(visual, faces=visual.faces[:, ::-1], normals=-visual.normals)


def _hulls(net: trimesh.Trimesh, path: Path, undecomposed: str | None, notes: list[str]) -> list[np.ndarray]:
    """Return convex pieces; or the convex hull with a note, if nothing better is found."""
    hulls, why = [], undecomposed
    if why is None:
        try:
            hulls, why = convex_pieces(net, _CONCAVITY, _MAX_PIECES), "nothing solid came out"
        except Exception as error:  # third-party code on odd nets
            why = f"{type(error).__name__}: {str(error)[:200]}"
    hulls = [hull for hull in hulls if solid_enough(hull)]
    if hulls:
        return hulls
    if not solid_enough(net.vertices):
        raise InputError(f"{path} encloses no volume: it is flat. Give it a thickness first.")
    notes.append(f"Its contact geometry is its convex hull: the decomposition failed ({why}).")
    return [np.array(net.vertices)]


def _assembled(
    path: Path,
    options: MeshOptions,
    visuals: Sequence[VisualMesh],
    hulls: Sequence[np.ndarray],
    y_up: bool,
    notes: list[str],
) -> tuple[ObjectModel, ObjectSource]:
    """Return the object in its resting pose, in its own frame, and its source."""
    R = resting_rotation(hulls) if options.stand else np.eye(3)
    angle = float(np.rad2deg(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))))
    if angle > 1.0:
        notes.append(f"It was turned by {angle:.0f} degrees to where it rests.")
    turned = [h @ R.T for h in hulls]
    lower, upper = pieces_bounds([CollisionPiece("mesh", vertices=h) for h in turned])
    shift = -(lower + upper) / 2
    pieces = tuple(CollisionPiece("mesh", vertices=h + shift) for h in turned)
    size_m = _vec3(upper - lower)
    if min(size_m) < MIN_SIZE_M:
        raise InputError(
            f"{path} is {_length(min(size_m))} thin; things thinner than {_length(MIN_SIZE_M)} slip through contacts. "
            "Give it a thickness first."
        )
    name = options.name_for(path)
    model = ObjectModel(
        name=name,
        kind=options.kind or name,
        description=options.description_for(path),
        mass_kg=_mass_kg(path, options, pieces),
        pieces=pieces,
        visuals=tuple(_moved(v, R, shift) for v in visuals),
        size_m=size_m,
        rolls=is_round(turned) if options.rolls is None else options.rolls,
        friction=options.friction,
        held_out=True,  # the grasp model has never seen it
    )
    w, x, y, z = (float(v) for v in wxyz_from_rotation(R @ Y_UP if y_up else R))
    source = ObjectSource(
        file="".join(c if c.isprintable() else "_" for c in path.name),
        sha256=file_fingerprint(path),
        scale=options.scale,
        position=_vec3(shift),
        wxyz=(w, x, y, z),
    )
    return model, source


def _mass_kg(path: Path, options: MeshOptions, pieces: Sequence[CollisionPiece]) -> float:
    if options.mass_kg is not None:
        return options.mass_kg
    mass_kg = sum(p.volume_m3 for p in pieces) * options.density_kg_m3
    if not MIN_MASS_KG <= mass_kg <= MAX_MASS_KG:
        raise InputError(
            f"{path} would weigh {mass_kg:.3g} kg (volume x {options.density_kg_m3:g} kg/m3); possible are "
            f"{MIN_MASS_KG:g} to {MAX_MASS_KG:g} kg. Give --mass, or check --scale."
        )
    return mass_kg


def _moved(visual: VisualMesh, R: Float[np.ndarray, "3 3"], shift: Float[np.ndarray, "3"]) -> VisualMesh:
    assert visual.normals is not None
    return replace(visual, vertices=visual.vertices @ R.T + shift, normals=visual.normals @ R.T)


def _vec3(values: np.ndarray) -> Vec3:
    x, y, z = (float(v) for v in values)
    return x, y, z


def answer(request: Mapping[str, Any], directory: Path) -> dict[str, Any]:
    """Return the notes of `make_object`, or why there is no object."""
    try:
        return {"notes": make_object(request, directory)}
    except InputError as error:
        return {"refused": str(error)}
    except MemoryError:
        return {"failed": "it needed more memory than is allowed"}
    except Exception as error:  # third-party code on hostile files may raise anything
        return {"failed": f"{type(error).__name__}: {str(error)[:300]}"}


def _limit(memory_bytes: int, cpu_s: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows; the time-out holds there too
        return
    for kind, limit in (
        (resource.RLIMIT_AS, memory_bytes),
        (resource.RLIMIT_CPU, cpu_s),
        (resource.RLIMIT_FSIZE, _MAX_FILE_BYTES),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(ValueError, OSError):  # macOS knows some of them by name only
            resource.setrlimit(kind, (limit, resource.getrlimit(kind)[1]))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    order = json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))
    _limit(order["memory_bytes"], ceil(order["limit_s"]))
    (folder / ANSWER_FILE).write_text(json.dumps(answer(order, folder)), encoding="utf-8")
