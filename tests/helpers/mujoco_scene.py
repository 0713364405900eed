"""Helpers for the tests of the object library: MuJoCo as the independent judge of its geometry."""

from collections.abc import Sequence

import mujoco

from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement

VISUAL_GROUP, CONTACT_GROUP = 0, 3
_SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}


def _add_object(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, model: ObjectModel, prefix: str, visuals: bool
) -> None:
    for i, (piece, mass) in enumerate(zip(model.pieces, model.piece_masses_kg, strict=True)):
        options = {
            "pos": piece.position,
            "quat": piece.wxyz,
            "mass": mass,
            "group": CONTACT_GROUP,
            "condim": 6 if model.rolls else 4,
            "friction": [model.friction, 0.005, 0.001],
        }
        if piece.kind == "mesh":
            spec.add_mesh(name=f"{prefix}p{i}", uservert=piece.mesh_vertices.ravel())
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{prefix}p{i}", **options)
        else:
            body.add_geom(type=_SHAPES[piece.kind], size=[*piece.size, 0, 0][:3], **options)
    for i, visual in enumerate(model.visuals if visuals else ()):
        spec.add_mesh(
            name=f"{prefix}v{i}",
            uservert=visual.vertices.ravel(),
            userface=visual.faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"{prefix}v{i}",
            contype=0,
            conaffinity=0,
            mass=0,
            group=VISUAL_GROUP,
        )


def mujoco_scene(
    placements: Sequence[ObjectPlacement], table_z_m: float | None, visuals: bool
) -> mujoco.MjModel:
    """Objects falling on a table, or fixed in space without one; contact pieces only or visuals too."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    if table_z_m is not None:
        size, friction = [5, 5, 0.1], [0.8, 0.005, 0.001]
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0, 0, table_z_m - 0.1], size=size, friction=friction
        )
    for k, placement in enumerate(placements):
        body = spec.worldbody.add_body(name=placement.name, pos=placement.position, quat=placement.wxyz)
        if table_z_m is not None:
            body.add_freejoint()
        _add_object(spec, body, load_object(placement.model), f"{k}_", visuals)
    return spec.compile()
