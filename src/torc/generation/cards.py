"""A card per problem: four views in one picture, the target, the difficulty, and the oracle's order."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from PIL import Image, ImageDraw, ImageFont

from torc.drawing.label_places import place_labels
from torc.drawing.palette import object_color
from torc.generation.config import Hiddenness
from torc.generation.inspection import Difficulty
from torc.geometry.transforms import Pose, look_at, rotation_from_wxyz
from torc.oracle.answer import OracleOrder
from torc.problems.problem import Problem
from torc.records import TARGET_ID
from torc.sim.rendering import CameraRenderer, View
from torc.sim.simulated_world import Presence, World, build_world, restore_state, save_state
from torc.specs.conditions import DEFAULT_WORKSPACE
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

VIEW_SIZE, GAP = (476, 357), 8
"""Size of the four views on a card, and the gap between them; pixels."""
HIDDENNESS_WORDS = {
    Hiddenness.VISIBLE: "in sight",
    Hiddenness.PARTLY: "partly in sight",
    Hiddenness.HIDDEN: "hidden",
}
_SCALE = 2
"""Views are drawn this much larger, for smooth edges."""
DRAWN_SIZE = (_SCALE * VIEW_SIZE[0], _SCALE * VIEW_SIZE[1])
_OUTLINE_PX = 2 * _SCALE
_DISC = 22 * _SCALE
"""Diameter of a number's disc, pixels."""
_INK, _PAPER = (28, 30, 34), (255, 255, 255)
ViewName = Literal["robot", "front", "side", "top"]
VIEW_NAMES: tuple[ViewName, ...] = get_args(ViewName)
_FOV_RAD = 0.7
"""Vertical field of view of all cameras but the robot's."""
_FILL = 0.84
"""Share of the picture, from its middle to its rim, that the clutter may take."""
_SIDE_FROM = (-0.15, -1.0, 0.45)
"""Direction from the clutter to the eye of the side view, world."""
_DASH_PX = round(3.5 * _OUTLINE_PX)


@dataclass(frozen=True)
class Card:
    """The content of a problem's card; with the oracle's order, if it is known."""

    problem: Problem
    difficulty: Difficulty
    order: OracleOrder | None = None

    @property
    def wanted(self) -> str:
        return self.problem.description or self.problem.target

    @property
    def facts(self) -> str:
        """Category and difficulty as text."""
        d = self.difficulty
        if self.problem.absent:
            return f"{self.problem.category}, {d.objects} objects; the target is not there"
        return (
            f"{self.problem.category}, {d.objects} objects, {100 * d.visible_fraction:.0f} % of the target in sight, "
            f"{d.in_front} in front of it, {d.beside} beside, {d.taller} taller"
        )

    @property
    def picks(self) -> str:
        """The oracle's verdict and its order as text; empty if there is none."""
        if self.order is None:
            return ""
        numbered = ", ".join(f"{k} {name}" for k, name in enumerate(self.order.names, start=1))
        return f"ORACLE: {self.order.verdict} {numbered}".strip()

    @property
    def numbers(self) -> dict[int, int]:
        """The number of the pick, from 1, in which each object of the order is first picked, by its id."""
        names = self.order.names if self.order else ()
        ids = enumerate(self.problem.ordered())
        return {i: names.index(o.name) + 1 for i, o in ids if o.name in names}

    def to_dict(self) -> dict[str, Any]:
        return {
            "problem": self.problem.name,
            "category": self.problem.category,
            "description": self.problem.description,
            "objects": self.difficulty.objects,
            **self.difficulty.facts(),
            "order": list(self.order.names) if self.order else None,
            "verdict": self.order.verdict if self.order else None,
        }


def draw_card(card: Card) -> Image.Image:
    """Draw the robot's view, and the problem from the front, the side and the top, with the numbers of the oracle's
    order.
    """
    image = Image.new("RGB", (2 * VIEW_SIZE[0] + GAP, 2 * VIEW_SIZE[1] + GAP), _PAPER)
    for k, (name, view) in enumerate(problem_views(card.problem).items()):
        picture = _numbered(view, {} if name == "robot" else card.numbers)
        title = "what the robot sees" if name == "robot" else name
        ImageDraw.Draw(picture).text((20, 12), title, _INK, ImageFont.load_default(15 * _SCALE))
        corner = (k % 2 * (VIEW_SIZE[0] + GAP), k // 2 * (VIEW_SIZE[1] + GAP))
        image.paste(picture.resize(VIEW_SIZE, Image.Resampling.BOX), corner)
    return image


def _numbered(view: View, numbers: dict[int, int]) -> Image.Image:
    """Write numbers on or beside some objects of a view."""
    picture = Image.fromarray(view.rgb)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(13 * _SCALE)
    discs = dict.fromkeys(numbers, ((_DISC, _DISC),) * 2)
    places = place_labels(np.ascontiguousarray(view.label_image), discs)
    for i, place in places.items():
        color = object_color(TARGET_ID) if i == TARGET_ID else _INK
        x, y = place.col + _DISC / 2, place.row + _DISC / 2
        if place.leader:
            draw.line([(x, y), place.anchor[::-1]], color, 2 * _SCALE)
        draw.circle((x, y), _DISC / 2, color, _PAPER, _SCALE)
        draw.text((x, y), str(numbers[i]), _PAPER, font, anchor="mm")
    return picture


def problem_views(problem: Problem) -> dict[ViewName, View]:
    """Draw the view of the robot's camera, and nearer views without further boxes of the workspace.

    These are from the front, from the side (the robot's right) and from the top (the robot below). The whole target is
    outlined in the colour images: solid where it is in sight, dashed where something hides it.
    """
    workspace = load_workspace(problem.workspace or DEFAULT_WORKSPACE)
    world = build_world(problem, None, workspace)
    points = np.concatenate(
        [
            mesh.vertices @ rotation_from_wxyz(wxyz).T + position
            for model, position, wxyz, there in zip(world.models, world.positions, world.wxyz, world.present)
            if there
            for mesh in model.visuals
        ]
    )
    own = replace(workspace.camera, width=DRAWN_SIZE[0], height=DRAWN_SIZE[1])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    near: dict[ViewName, Pose] = {
        "front": _fitting(points, own.T_world_camera[:3, 3] - middle),
        "side": _fitting(points, np.array(_SIDE_FROM)),
        # A hair off the vertical, so that the top view has the robot below.
        "top": _fitting(points, np.array([-1e-3, 0.0, 1.0])),
    }
    # Walls and roofs would hide the objects among them from the side and from above.
    bare = build_world(replace(problem, workspace=""), None, replace(workspace, obstacles=()))
    mount = CameraMount(near["front"], *DRAWN_SIZE, _FOV_RAD)
    return _render(world, own, {"robot": own.T_world_camera}) | _render(bare, mount, near)


def _render(world: World, mount: CameraMount, poses: Mapping[ViewName, Pose]) -> dict[ViewName, View]:
    state = save_state(world)
    with CameraRenderer(world, mount) as renderer:
        views = {name: renderer.render(pose) for name, pose in poses.items()}
        for other in range(world.object_count):
            if other != TARGET_ID:
                world.park(other, Presence.DROPPED)
        for name, view in views.items():
            whole = renderer.render(poses[name], color=False).label_image == TARGET_ID
            views[name] = replace(view, rgb=_outlined(view.rgb, whole, view.label_image == TARGET_ID))
        restore_state(world, state)
    return views


def _fitting(points: Float[np.ndarray, "n 3"], way: Float[np.ndarray, "3"]) -> Pose:
    """Return the nearest camera that looks against a direction and has all points in the picture, with a margin."""
    pose = look_at(way, np.zeros(3))
    across, down, along = (points @ pose[:3, :3]).T
    slope_down = _FILL * np.tan(_FOV_RAD / 2)
    # A point is in the picture if |across - x| <= slope (along - z), and so on: two half-planes for each direction.
    x, z_across = _apex(across, along, slope_down * DRAWN_SIZE[0] / DRAWN_SIZE[1])
    y, z_down = _apex(down, along, slope_down)
    pose[:3, 3] = pose[:3, :3] @ [x, y, min(z_across, z_down)]
    return pose


def _apex(across: Float[np.ndarray, "n"], along: Float[np.ndarray, "n"], slope: float) -> tuple[float, float]:
    """Return the tip of the narrowest wedge of that slope around some points: its across and along."""
    highest, lowest = float((across - slope * along).max()), float((across + slope * along).min())
    return (highest + lowest) / 2, (lowest - highest) / (2 * slope)


def _outlined(
    image: UInt8[np.ndarray, "h w 3"], whole: Bool[np.ndarray, "h w"], seen: Bool[np.ndarray, "h w"]
) -> UInt8[np.ndarray, "h w 3"]:
    """Outline a mask: solid near its visible part, dashed elsewhere."""
    image = image.copy()
    near = cv2.dilate(seen.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    contours, _ = cv2.findContours(whole.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    for color, width in ((_PAPER, 2 * _OUTLINE_PX), (object_color(TARGET_ID), _OUTLINE_PX)):
        for contour in contours:
            points = contour[:, 0]
            for i, (a, b) in enumerate(zip(points, np.roll(points, -1, axis=0))):
                if near[a[1], a[0]] or i // _DASH_PX % 2 == 0:
                    cv2.line(image, a.tolist(), b.tolist(), color, width)
    return image
