"""Build the simulated world as a MuJoCo specification: physics options, lights, table, bin, objects."""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np

from torc.objects.models import ObjectModel
from torc.problems.problem import Problem
from torc.robots.description import RobotDescription
from torc.workspace.description import Box, Workspace

VISUAL_GROUP, COLLISION_GROUP = 1, 3
_ROOM = (
    Box("room_front", (2.65, 0.0, 1.5), (0.1, 5.2, 3.0)),
    Box("room_left", (1.6, 2.65, 1.5), (2.2, 0.1, 3.0)),
    Box("room_right", (1.6, -2.65, 1.5), (2.2, 0.1, 3.0)),
)
"""The room in front of the robot. Without it the camera looks into the sky, where it has no reading, and the air above
the table would never be seen free.
"""


@dataclass(frozen=True)
class WorldConfig:
    """Physics and looks. The defaults were tuned together: a firm grasp and no explosions; change with care.

    Attributes:
        impratio: stiffness of friction relative to that of contact; below 10 held objects creep.
        rolling_friction_round_m: of objects that roll; with less, settling never ends.
        light_kg: contacts of MuJoCo are as stiff as the lighter body is heavy: a finger that presses 40 N on a 15 g
            sponge would sink in by centimetres. So objects lighter than this get a shorter time constant, but none
            shorter than `light_solref_s`, which is four time steps.
        object_solimp: of objects' contacts; MuJoCo's own (.9, .95) is five times as soft under load.
        sleeping: in a world with a robot, objects at rest are not computed until something touches one of those that
            lie together: a pick gets several times cheaper, but what would creep on for ever stays where it is.
        samples: of antialiasing, 0 for none; 4 makes drawing in software three times as slow.
        surfaces: objects have visible surfaces. Without them the world is built in half the time.
        implicit: integrate velocities implicitly, which servos need; otherwise the solver needs half the iterations.
    """

    timestep_s: float = 0.002
    impratio: float = 50.0
    solver_iterations: int = 50
    solver_tolerance: float = 1e-8
    torsional_friction_m: float = 0.005
    rolling_friction_m: float = 0.0005
    rolling_friction_round_m: float = 0.001
    object_solref_s: float = 0.02
    light_kg: float = 0.1
    light_solref_s: float = 0.008
    object_solimp: tuple[float, float, float] = (0.95, 0.99, 0.001)
    sleeping: bool = True
    shadow_size: int = 1024
    samples: int = 0
    surfaces: bool = True
    implicit: bool = True


def build_spec(
    problem: Problem,
    models: tuple[ObjectModel, ...],
    robot: RobotDescription | None,
    workspace: Workspace,
    config: WorldConfig,
    extra: tuple[Box, ...] = (),
) -> mujoco.MjSpec:
    """Build the whole world; models[i] is the model of object id i."""
    spec = mujoco.MjSpec()
    spec.modelname = "torc"
    if robot is not None:
        # Not the other way round: a robot file's defaults and options would also apply to the table and the objects.
        of_robot = mujoco.MjSpec.from_file(str(robot.mjcf_path))
        spec.attach(of_robot, prefix="", frame=spec.worldbody.add_frame())
    _set_options(spec, config, sleeping=config.sleeping and robot is not None)
    _set_looks(spec, workspace, config)
    _add_static(spec, workspace, extra)
    for model in {model.name: model for model in models}.values():
        _add_assets(spec, model, config)
    for object_id, (placement, model) in enumerate(zip(problem.ordered(), models)):
        body = spec.worldbody.add_body(name=object_body_name(object_id))
        body.pos, body.quat = list(placement.position), list(placement.wxyz)
        _add_object(body, object_body_name(object_id), model, config)
    return spec


def object_body_name(object_id: int) -> str:
    return f"object_{object_id}"


def _set_options(spec: mujoco.MjSpec, config: WorldConfig, sleeping: bool) -> None:
    option = spec.option
    option.timestep, option.impratio = config.timestep_s, config.impratio
    kinds = mujoco.mjtIntegrator
    option.integrator = kinds.mjINT_IMPLICITFAST if config.implicit else kinds.mjINT_EULER
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations, option.tolerance = config.solver_iterations, config.solver_tolerance
    if sleeping:
        option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    # A world that broke must report it, not quietly restart from its first state.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET


def _set_looks(spec: mujoco.MjSpec, workspace: Workspace, config: WorldConfig) -> None:
    mount, visual = workspace.camera, spec.visual
    visual.quality.offsamples, visual.quality.shadowsize = config.samples, config.shadow_size
    visual.global_.offwidth, visual.global_.offheight = mount.width, mount.height
    visual.headlight.ambient, visual.headlight.diffuse = [0.42] * 3, [0.0] * 3
    visual.headlight.specular = [0.0] * 3
    spec.stat.extent, spec.stat.center = 2.0, [0.5, 0.0, 1.0]
    visual.map.shadowclip, visual.map.shadowscale = 0.6, 0.8
    world = spec.worldbody
    key = world.add_light(name="key_light", pos=[0.1, 0.7, 3.2], dir=[0.18, -0.26, -0.95])
    key.type, key.diffuse, key.specular = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, [0.5] * 3, [0.15] * 3
    fill = world.add_light(name="fill_light", pos=[0.0, -0.4, 2.2], dir=[0.7, 0.3, -0.6], castshadow=False)
    fill.type, fill.diffuse, fill.specular = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, [0.28] * 3, [0.0] * 3
    sky = sky_texture((0.82, 0.87, 0.93), (0.55, 0.66, 0.80))
    _add_texture(spec, "sky", sky, mujoco.mjtTexture.mjTEXTURE_SKYBOX)


def _add_static(spec: mujoco.MjSpec, workspace: Workspace, extra: tuple[Box, ...]) -> None:
    material = _add_material(spec, "floor", checker_texture((0.62, 0.64, 0.66), (0.56, 0.58, 0.60)))
    spec.material("floor").texrepeat = [2, 2]
    spec.material("floor").texuniform = True
    floor = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1])
    floor.castshadow = False  # nothing is below it, and it would speckle itself
    floor.material, floor.condim, floor.friction = material, 4, [0.8, 0.005, 0.0005]
    wood = _add_material(spec, "wood", wood_texture())
    spec.material("wood").texrepeat = [1, 1]
    gray = _add_material(spec, "bin", None, (0.36, 0.42, 0.50, 1.0))
    dark = _add_material(spec, "stand", None, (0.25, 0.26, 0.28, 1.0))
    for box in (*workspace.static_boxes(), *extra):
        geom = _add_box(spec, box)
        geom.condim, geom.friction = 4, [0.8, 0.005, 0.0005]
        geom.material = wood if box is workspace.table else gray
    wall = _add_material(spec, "wall", None, (0.93, 0.92, 0.89, 1.0))
    for boxes, material in ((_supports(workspace), dark), (_ROOM, wall)):
        for box in boxes:
            geom = _add_box(spec, box)
            geom.contype, geom.conaffinity, geom.group, geom.material = 0, 0, VISUAL_GROUP, material
            geom.castshadow = boxes is not _ROOM


def _add_box(spec: mujoco.MjSpec, box: Box) -> mujoco.MjsGeom:
    half, kind = [0.5 * s for s in box.size], mujoco.mjtGeom.mjGEOM_BOX
    return spec.worldbody.add_geom(name=box.name, type=kind, pos=list(box.center), size=half)


def _supports(workspace: Workspace) -> tuple[Box, ...]:
    """Return legs of the table and the stand of the bin: visible, not touchable."""
    (x, y, z), (lx, ly, lz) = workspace.table.center, workspace.table.size
    leg, height = 0.06, z - lz / 2
    legs = [
        Box(f"leg_{i}{j}", (x + i * (lx - leg) / 2, y + j * (ly - leg) / 2, height / 2), (leg, leg, height))
        for i in (-1, 1)
        for j in (-1, 1)
    ]
    (bx, by, bz), (sx, sy, _) = workspace.bin.center, workspace.bin.inner_size
    top = bz - 2 * workspace.bin.wall_m
    return *legs, Box("bin_stand", (bx, by, top / 2), (0.6 * sx, 0.6 * sy, top))


def _add_object(body: mujoco.MjsBody, name: str, model: ObjectModel, config: WorldConfig) -> None:
    """Add contact pieces (they carry the mass) and surfaces of a free body; equal objects share meshes."""
    body.add_freejoint(name=f"{name}_free")
    for i, (piece, mass_kg) in enumerate(zip(model.pieces, model.piece_masses_kg)):
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{piece.kind.upper()}")
        geom = body.add_geom(type=kind, pos=list(piece.position), quat=list(piece.wxyz))
        geom.name, geom.group, geom.mass = f"{name}_piece_{i}", COLLISION_GROUP, mass_kg
        geom.size = [*piece.size, 0, 0, 0][:3]
        geom.condim = 6 if model.rolls else 4
        rolling = config.rolling_friction_round_m if model.rolls else config.rolling_friction_m
        geom.friction = [model.friction, config.torsional_friction_m, rolling]
        stiffening = min(1.0, np.sqrt(model.mass_kg / config.light_kg))
        geom.solref = [max(config.light_solref_s, config.object_solref_s * stiffening), 1.0]
        # Against a heavier body the lighter one's time constant counts.
        geom.solmix = stiffening**-4
        geom.solimp = [*config.object_solimp, 0.5, 2.0]
        if piece.kind == "mesh":
            geom.meshname = f"{model.name}_piece_{i}"
    for i in range(len(model.visuals) if config.surfaces else 0):
        geom = body.add_geom(name=f"{name}_visual_{i}", type=mujoco.mjtGeom.mjGEOM_MESH)
        geom.group, geom.contype, geom.conaffinity, geom.mass = VISUAL_GROUP, 0, 0, 0.0
        geom.meshname = geom.material = f"{model.name}_visual_{i}"


def _add_assets(spec: mujoco.MjSpec, model: ObjectModel, config: WorldConfig) -> None:
    for i, piece in enumerate(model.pieces):
        if piece.kind == "mesh":
            mesh = spec.add_mesh(name=f"{model.name}_piece_{i}")
            mesh.uservert = piece.mesh_vertices.astype(np.float32).ravel()
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    for i, visual in enumerate(model.visuals if config.surfaces else ()):
        name = f"{model.name}_visual_{i}"
        mesh = spec.add_mesh(name=name)
        mesh.uservert = _four_rows(visual.vertices)
        mesh.userface = visual.faces.astype(np.int32).ravel()
        if visual.uv is not None:
            mesh.usertexcoord = _four_rows(visual.uv)
        if visual.normals is not None:
            mesh.usernormal = _four_rows(visual.normals)
        # A visual surface may be open; the mass comes from the contact pieces.
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        _add_material(spec, name, visual.texture, visual.rgba, specular=0.25, shininess=0.4)


def _four_rows(rows: np.ndarray) -> np.ndarray:
    """Flatten rows, repeating the last: MuJoCo wants four vertices even for a single triangle."""
    some = rows if len(rows) >= 4 else np.pad(rows, ((0, 4 - len(rows)), (0, 0)), mode="edge")
    return some.astype(np.float32).ravel()


def _add_material(
    spec: mujoco.MjSpec,
    name: str,
    texture: np.ndarray | None,
    rgba: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    specular: float = 0.1,
    shininess: float = 0.2,
) -> str:
    material = spec.add_material(name=name, rgba=list(rgba), specular=specular, shininess=shininess)
    if texture is not None:
        _add_texture(spec, name, texture, mujoco.mjtTexture.mjTEXTURE_2D)
        material.textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = name
    return name


def _add_texture(spec: mujoco.MjSpec, name: str, image: np.ndarray, kind: mujoco.mjtTexture) -> None:
    height, width = image.shape[:2]
    texture = spec.add_texture(name=name, type=kind, width=width, height=height, nchannel=3)
    texture.data = np.ascontiguousarray(image).tobytes()


@cache
def wood_texture(size: int = 256) -> np.ndarray:
    """Return planks with a grain, always the same: (size, size, 3) uint8, read-only."""
    rng = np.random.default_rng(7)
    v, u = np.meshgrid(np.arange(size) / size, np.arange(size) / size, indexing="ij")
    plank = np.floor(v * 6).astype(int)
    tone, phase = rng.uniform(-0.06, 0.06, 6)[plank], rng.uniform(0, 9, 6)[plank]
    wave = 0.9 * np.sin(2 * np.pi * u + phase) + 0.5 * np.sin(4 * np.pi * u + 2 * phase)
    grain = 0.5 + 0.5 * np.sin(2 * np.pi * (v * 38 + 0.35 * wave) + 3 * phase)
    seam = np.where((v * 6) % 1 < 0.03, 0.75, 1.0)
    light = (0.93 + tone + 0.07 * grain) * seam + 0.012 * rng.standard_normal((size, size))
    color = light[..., None] * np.array([0.80, 0.66, 0.48])
    texture = np.asarray(np.clip(color, 0, 1) * 255, dtype=np.uint8)
    texture.flags.writeable = False
    return texture


def checker_texture(
    a: tuple[float, float, float], b: tuple[float, float, float], size: int = 64
) -> np.ndarray:
    """Return two by two squares of two colours: (size, size, 3) uint8."""
    i, j = np.indices((size, size)) // (size // 2)
    return np.asarray(np.where(((i + j) % 2)[..., None], a, b) * np.float64(255), dtype=np.uint8)


def sky_texture(
    low: tuple[float, float, float], high: tuple[float, float, float], size: int = 32
) -> np.ndarray:
    """Return six faces of a sky box, stacked: sides shade upwards."""
    t = np.linspace(1, 0, size)[:, None, None]
    side = np.broadcast_to(t * np.array(high) + (1 - t) * np.array(low), (size, size, 3))
    faces = [side, side, np.broadcast_to(high, side.shape), np.broadcast_to(low, side.shape), side, side]
    return np.asarray(np.concatenate(faces) * 255, dtype=np.uint8)
