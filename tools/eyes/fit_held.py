"""How surely what is in the hand is the target: fitted on picks in scenes in which every object is the target once.

Picks are random ones. Before each, and after its lift, torc's own eyes look; the reference pictures are a turn-table of
each object, as in simulated trials.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy.optimize import minimize

from tools.eyes.fit_target import references
from tools.grasp_model.scenes import SceneConfig, make_scene
from torc.episode.held import SURE
from torc.episode.loop import Episode
from torc.episode.simulated import simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.geometry.extent import Extent
from torc.objects.library import load_object
from torc.perception.embedded.model import crop, describe
from torc.perception.embedded.perception import EmbeddedPerception
from torc.perception.protocol import Wanted
from torc.perception.target import (
    TargetConfig,
    held_probability,
    size_in_sight,
    stretch,
    target_probabilities,
)
from torc.pipeline.building import System, build_system
from torc.problems.problem import Problem
from torc.records import Decision, Observation, SegmentedScene
from torc.sim.portraits import size_by_ruler
from torc.specs.conditions import Conditions

_PICKS = 8
_DOUBT = 0.3
"""What is this probable before the pick may well be picked for the target."""


@dataclass(frozen=True)
class HeldCase:
    """What is in the hand, if one object is the target: the cosine to its pictures, how surely it was the target before
    the pick, how much larger it looks (`stretch`), and whether it is."""

    cosine: float
    before: float
    stretched: Float[np.ndarray, "2"]
    right: bool

    def probability(self, config: TargetConfig) -> float:
        """How surely it is the target."""
        return held_probability(self.cosine, self.before, config, self.stretched)


class Noting(EmbeddedPerception):
    """Keeps what it is asked about in the hand: the scene of before, the object's id there, what it looks like, and how
    large it is."""

    noted: tuple[SegmentedScene, int, Float32[np.ndarray, "d"], Extent] | None = None

    def recognise(
        self,
        observation: Observation,
        mask: Bool[np.ndarray, "h w"],
        wanted: Wanted,
        scene: SegmentedScene,
        object_id: int,
    ) -> float | None:
        """Nothing is the target, so that the episode goes on."""
        if mask.any():
            look = describe(crop(observation.rgb, mask)[None])[0]
            self.noted = scene, object_id, look, self.size_in_hand(observation, mask)
        return 0.0


def fit_held(scenes: int, depth: str, held_out: bool, seed: int = 78) -> None:
    """Prints the fit, and how often what is in the hand is known for the target, or taken for it."""
    system = build_system(Conditions(perception=f"{__name__}:{Noting.__name__}", depth=depth))
    cases: list[HeldCase] = []
    for number in range(scenes):
        rng = np.random.default_rng([seed, number, held_out])
        problem = make_scene(rng, system.workspace, held_out, SceneConfig(8, 18, unseen_share=1.0))
        if problem is not None:
            cases += picked(problem, system, rng)
    config = TargetConfig()
    fitted = fitted_config(cases, config)
    print(
        f"{sum(c.right for c in cases)} targets in the hand, {sum(not c.right for c in cases)} other objects"
    )
    print(f"held_likeness {fitted.held_likeness:.3f}, held_steepness {fitted.held_steepness:.1f}, ", end="")
    print(f"held_trust {fitted.held_trust:.2f}")
    for name, tried in (("shipped", config), ("fitted", fitted)):
        for sure in (0.5, 0.7, 0.8, SURE):
            taken = [(c, c.probability(tried) >= sure) for c in cases]
            known = np.mean([t for c, t in taken if c.right])
            doubtful, others = (
                [t for c, t in taken if not c.right and (c.before >= _DOUBT) == doubt]
                for doubt in (True, False)
            )
            print(
                f"{name}, sure {sure}: {known:.3f} of the targets known; taken for it: {sum(doubtful)} of "
                f"{len(doubtful)} that were doubtful before, {sum(others)} of {len(others)} others"
            )


def picked(problem: Problem, system: System, rng: np.random.Generator) -> list[HeldCase]:
    """Random picks in a scene, each with every object of the scene as the target."""
    eyes = system.pipeline.perception
    assert isinstance(eyes, Noting)
    models, cases = [o.model for o in problem.ordered()], list[HeldCase]()
    with simulated_robot(system, problem) as robot:
        robot.take_over()
        episode = Episode(robot, system, Wanted(problem.description), EpisodeConfig(_PICKS))
        while (look := episode.look()) is not None:
            graspable = look.context.report.graspable_ids
            eyes.noted = None
            choice = int(rng.choice(graspable)) if graspable else None
            episode.pick(look, Decision(choice, "a random one"))
            held_id = episode.state.outcomes[-1].held_id
            if eyes.noted is not None and held_id is not None:
                cases += _cases(*eyes.noted, models, models[held_id])
            episode.end = None  # whatever came out, and whatever fell
    return cases


def _cases(
    scene: SegmentedScene,
    object_id: int,
    seen: Float32[np.ndarray, "d"],
    held_m: Extent,
    models: list[str],
    held: str,
) -> list[HeldCase]:
    looks = {k.id: k.look for k in scene.known}
    of_masks = np.stack([looks[k] for k in scene.ids])
    pixels = [o.pixel_count for o in scene.objects]
    sizes_m = [size_in_sight(o.points) for o in scene.objects]
    cases = []
    for model in dict.fromkeys(models):
        pictures = references(model)
        told_m = size_by_ruler(load_object(model))
        p = target_probabilities(of_masks, pixels, pictures, TargetConfig(), stretch(sizes_m, told_m))
        before, larger = float(p[scene.ids.index(object_id)]), stretch([held_m], told_m)[0]
        cases.append(HeldCase(float((pictures @ seen).max()), before, larger, model == held))
    return cases


def fitted_config(cases: list[HeldCase], start: TargetConfig) -> TargetConfig:
    """The likeliest numbers of `held_probability`."""
    right = np.array([c.right for c in cases])

    def config(numbers: Float[np.ndarray, "3"]) -> TargetConfig:
        likeness, steepness, trust = (float(v) for v in numbers)
        return replace(
            start, held_likeness=likeness, held_steepness=float(np.exp(steepness)), held_trust=trust
        )

    def loss(numbers: Float[np.ndarray, "3"]) -> float:
        p = np.array([c.probability(config(numbers)) for c in cases])
        return -float(np.log(np.clip(np.where(right, p, 1 - p), 1e-9, 1)).sum())

    begin = [start.held_likeness, np.log(start.held_steepness), start.held_trust]
    return config(minimize(loss, begin, method="Nelder-Mead").x)
