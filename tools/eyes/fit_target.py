"""How surely a mask is the target: fitted on scenes in which every object is the target once.

The masks are those of torc's own eyes on depth from a stereo pair; the reference pictures are a turn-table of the
target, as in simulated trials.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float, Float32
from scipy.optimize import minimize

from tools.grasp_model.scenes import SceneConfig, make_scene
from torc.episode.identity import shown_by
from torc.geometry.extent import Extent
from torc.objects.library import load_object
from torc.perception.embedded.model import crop, describe
from torc.perception.embedded.perception import EmbeddedConfig, EmbeddedPerception
from torc.perception.protocol import Wanted
from torc.perception.stereo import SgbmDepth
from torc.perception.target import (
    TargetConfig,
    choose_target,
    reference_mask,
    size_in_sight,
    stretch,
    target_probabilities,
)
from torc.problems.problem import Problem
from torc.sim.portraits import size_by_ruler, turn_table
from torc.sim.robot import SimulatedCamera
from torc.sim.simulated_world import build_world
from torc.sim.stereo_camera import StereoRig
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace

_SIZES = ("too_long", "too_thick")


@dataclass(frozen=True)
class Case:
    """One object of one scene as the target.

    Attributes:
        looks, pixels, sizes_m: of each mask.
        references: what the target looks like from its sides.
        size_m: of the target, by a ruler.
        right: index of the mask that shows the target, or None: it is not in sight, or has no mask.
    """

    looks: Float32[np.ndarray, "n d"]
    pixels: tuple[int, ...]
    sizes_m: list[Extent]
    references: Float32[np.ndarray, "m d"]
    size_m: tuple[float, float]
    right: int | None


def fit_target(scenes: int, held_out: bool, seed: int = 77) -> None:
    """Prints the fit, and how often the rule is right, wrong, or sees no target where there is one."""
    cases: list[Case] = []
    for number in range(scenes):
        cases += scene_cases(np.random.default_rng([seed, number, held_out]), load_workspace(), held_out)
    fitted = fitted_config(cases, TargetConfig())
    print(f"{len(cases)} targets in {scenes} scenes")
    print(
        f"likeness {fitted.likeness:.3f}, steepness {fitted.steepness:.1f}, pixels {fitted.pixels:.2f}, ",
        end="",
    )
    print(", ".join(f"{name} {getattr(fitted, name):.1f}" for name in _SIZES))
    for name, config in (("shipped", TargetConfig()), ("fitted", fitted)):
        for sure in (0.5, 0.7, 0.8, 0.9):
            tried = replace(config, sure=sure, still=min(config.still, sure))
            chosen = [(choose(case, tried), case.right) for case in cases]
            there = [(c, r) for c, r in chosen if r is not None]
            found = np.mean([c == r for c, r in there])
            wrong = np.mean([c is not None and c != r for c, r in chosen])
            print(f"{name}, sure {sure}: found {found:.3f} of those in sight, wrong {wrong:.4f} of all")


def choose(case: Case, config: TargetConfig) -> int | None:
    """The mask that is taken for the target."""
    return choose_target(probabilities(case, config), None, config)


def probabilities(case: Case, config: TargetConfig) -> Float[np.ndarray, "n"]:
    """How surely each mask is the target."""
    stretched = stretch(case.sizes_m, case.size_m)
    return target_probabilities(case.looks, case.pixels, case.references, config, stretched)


def scene_cases(rng: np.random.Generator, workspace: Workspace, held_out: bool) -> list[Case]:
    """Every object of a scene as the target; none if it fell apart."""
    config = SceneConfig(min_objects=8, max_objects=18, unseen_share=1.0)
    problem = make_scene(rng, workspace, held_out, config)
    if problem is None:
        return []
    looks, pixels, sizes_m, true_ids = _seen(problem, workspace)
    cases = []
    for object_id, placement in enumerate(problem.ordered()):
        shown = [i for i, k in enumerate(true_ids) if k == object_id]
        right = max(shown, key=lambda i: pixels[i]) if shown else None
        size_m = size_by_ruler(load_object(placement.model))
        cases.append(Case(looks, pixels, sizes_m, references(placement.model), size_m, right))
    return cases


def _seen(
    problem: Problem, workspace: Workspace
) -> tuple[Float32[np.ndarray, "n d"], tuple[int, ...], list[Extent], tuple[int, ...]]:
    """What each mask looks like, its pixels, its size, and what it shows."""
    with SimulatedCamera(build_world(problem, None, workspace), rig=StereoRig()) as camera:
        capture = camera.capture()
    truth = capture.label_image
    assert truth is not None  # a simulated camera knows it
    seen = SgbmDepth().measure(capture.observation)
    scene = EmbeddedPerception(EmbeddedConfig.rough(), workspace).perceive(seen, Wanted(""), None)
    shows = shown_by(scene, truth)
    looks = {k.id: k.look for k in scene.known}
    return (
        np.stack([looks[k] for k in scene.ids]),
        tuple(o.pixel_count for o in scene.objects),
        [size_in_sight(o.points) for o in scene.objects],
        tuple(shows[k] for k in scene.ids),
    )


@cache
def references(model: str) -> Float32[np.ndarray, "m d"]:
    """What an object looks like on each picture of a turn-table."""
    pictures = turn_table(load_object(model))
    return describe(np.stack([crop(p[..., :3], reference_mask(p)) for p in pictures]))


def fitted_config(cases: list[Case], start: TargetConfig) -> TargetConfig:
    """The likeliest numbers of `target_probabilities`: of which mask it is, or of none."""

    def config(numbers: Float[np.ndarray, "5"]) -> TargetConfig:
        likeness, steepness, pixels, *sizes = (float(v) for v in numbers)
        return replace(
            start,
            likeness=likeness,
            steepness=float(np.exp(steepness)),
            pixels=pixels,
            **{name: max(value, 0.0) for name, value in zip(_SIZES, sizes, strict=True)},
        )

    def loss(numbers: Float[np.ndarray, "5"]) -> float:
        total = 0.0
        for case in cases:
            p = probabilities(case, config(numbers))
            total -= np.log(max(1 - p.sum() if case.right is None else p[case.right], 1e-9))
        return total

    begin = [
        start.likeness,
        np.log(start.steepness),
        start.pixels,
        *(getattr(start, n) or 1.0 for n in _SIZES),
    ]
    return config(minimize(loss, begin, method="Nelder-Mead", options={"maxiter": 2000}).x)
