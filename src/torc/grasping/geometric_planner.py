"""Plan grasps by geometry: propose, check, measure, score, select."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8, UInt64

from torc.errors import InputError
from torc.grasping.candidate_checks import Fault, check_candidates
from torc.grasping.clouds import ObjectCloud, SceneClouds, build_clouds
from torc.grasping.config import CandidateConfig, GraspConfig
from torc.grasping.features import FEATURE_NAMES, compute_features
from torc.grasping.generators import GENERATORS, GeneratorInput, RawCandidates
from torc.grasping.hand import hand_geometry
from torc.grasping.hand_contacts import voxel_blockers
from torc.grasping.protocol import GraspScorer
from torc.grasping.selection import chosen, thinned
from torc.grasping.trees import load_trees
from torc.parallel import each
from torc.records import MAX_OBJECTS, GraspSet, OcclusionVolume, SegmentedScene
from torc.robots.gripper import GripperDescription

MODEL_PATH = Path(__file__).parent / "data" / "grasp_model.npz"


@cache
def default_scorer(rough_depth: bool = False) -> GraspScorer:
    """Load the shipped model, calibrated for exact depth or for depth with a sensor's errors; read once."""
    model = load_trees(MODEL_PATH, FEATURE_NAMES)
    return model.for_rough_depth() if rough_depth else model


GENERATOR_NAMES = tuple(GENERATORS)
NO_GRASPS = GraspSet(
    Ts_world_tcp=np.zeros((0, 4, 4)),
    widths_m=np.zeros(0),
    scores=np.zeros(0),
    object_ids=np.zeros(0, dtype=np.int16),
    contacts=np.zeros((0, 2, 3)),
    generators=np.zeros(0, dtype=np.uint8),
    generator_names=GENERATOR_NAMES,
)
_COLUMNS = ("Ts_world_tcp", "widths_m", "scores", "object_ids", "contacts", "generators")
_DEPTH_PER_OPENING = 0.88
"""An object this deep, in openings of the hand, still fits between the fingers: 75 mm for a 2F-85."""


@dataclass(frozen=True)
class CandidateSet:
    """Candidates before selection that are graspable as far as their own object and the table are concerned.

    Attributes:
        grasps: in the order of proposal.
        features: one row per grasp, columns FEATURE_NAMES.
        blocked: the gripper touches other objects or has them between its pads.
        blockers: which objects those are, bit k for object id k.
        proposed: how many candidates were examined, including rejected ones.
    """

    grasps: GraspSet
    features: Float32[np.ndarray, "n f"]
    blocked: Bool[np.ndarray, "n"]
    blockers: UInt64[np.ndarray, "n"]
    proposed: int


@dataclass(frozen=True)
class Proposals:
    """Unchecked candidates of one object.

    Attributes:
        raw: where the gripper would be.
        generators: index into the planner's generator_names.
        scores: replace the planner's own score; None to keep it.
    """

    raw: RawCandidates
    generators: UInt8[np.ndarray, "n"]
    scores: Float[np.ndarray, "n"] | None = None


Rngs = Mapping[int, np.random.Generator]


class GeometricGraspPlanner:
    """Plans grasps from geometry alone; needs no trained network, only a score (by default the shipped model)."""

    generator_names: tuple[str, ...] = GENERATOR_NAMES
    """Names of the generators."""

    def __init__(
        self,
        gripper: GripperDescription,
        support_z_m: float,
        config: GraspConfig | None = None,
        scorer: GraspScorer | None = None,
    ) -> None:
        if not np.isfinite(support_z_m):
            raise InputError(f"The height of the support is {support_z_m}; give it in metres.")
        self.hand = hand_geometry(gripper)
        self.support_z_m = float(support_z_m)
        config = GraspConfig() if config is None else config
        depth_m = max(config.clouds.max_hidden_depth_m, _DEPTH_PER_OPENING * self.hand.max_width_m)
        self.config = replace(config, clouds=replace(config.clouds, max_hidden_depth_m=depth_m))
        self.scorer = default_scorer(self.config.rough_depth) if scorer is None else scorer

    def plan(self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator) -> GraspSet:
        """Return grasps of all visible objects that are large enough, the best of each object first."""
        parts, config = self._propose(scene, volume, rng), self.config.selection
        kept = [thinned(p.grasps.scores, p.blocked, p.grasps.Ts_world_tcp, config) for p in parts]
        free = [k[~p.blocked[k]] for p, k in zip(parts, kept)]
        spread = self._concatenated([_rows(p.grasps, k) for p, k in zip(parts, free)])
        in_the_way = voxel_blockers(spread, volume, self.hand) != 0
        ends, out = np.cumsum([len(f) for f in free], dtype=np.int64), []
        for part, k, f, blocked_now in zip(parts, kept, free, np.split(in_the_way, ends)):
            blocked = part.blocked.copy()
            blocked[f] = blocked_now
            out.append(_rows(part.grasps, chosen(k, part.grasps.scores, blocked, config)))
        return self._concatenated(out)

    def candidates(
        self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator
    ) -> CandidateSet:
        """Return what `plan` selects from, for training. Equal generator states give equal candidates."""
        parts = self._propose(scene, volume, rng)
        return CandidateSet(
            self._concatenated([p.grasps for p in parts]),
            np.concatenate([p.features for p in parts] or [np.zeros((0, len(FEATURE_NAMES)), np.float32)]),
            np.concatenate([p.blocked for p in parts] or [np.zeros(0, dtype=bool)]),
            np.concatenate([p.blockers for p in parts] or [np.zeros(0, dtype=np.uint64)]),
            sum(p.proposed for p in parts),
        )

    def propose(self, scene: SegmentedScene, clouds: SceneClouds, rngs: Rngs) -> Mapping[int, Proposals]:
        """Return unchecked candidates for each of `clouds.objects`; a subclass may take them from elsewhere.

        `rngs` holds a generator per object id.
        """
        config = self.config.candidates

        def generated(cloud: ObjectCloud) -> Proposals:
            own = config.for_target() if cloud.id == scene.target_id else config
            return self._generated(cloud, clouds, own, rngs[cloud.id])

        return dict(zip((cloud.id for cloud in clouds.objects), each(generated, clouds.objects)))

    def _generated(
        self, cloud: ObjectCloud, clouds: SceneClouds, config: CandidateConfig, rng: np.random.Generator
    ) -> Proposals:
        checks = self.config.checks
        given = GeneratorInput(
            cloud,
            self.hand,
            clouds.forward,
            self.support_z_m,
            checks.tip_margin_m,
            checks.min_points_between,
            config,
        )
        proposals = [propose(given, rng) for propose in GENERATORS.values()]
        raw = RawCandidates(
            np.concatenate([p.Rs for p in proposals]),
            np.concatenate([p.tips for p in proposals]),
            np.concatenate([p.widths_m for p in proposals]),
        )
        return Proposals(
            raw, np.repeat(np.arange(len(proposals), dtype=np.uint8), [len(p) for p in proposals])
        )

    def _propose(
        self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator
    ) -> list[CandidateSet]:
        """Return the candidates of each object."""
        clouds = build_clouds(scene, volume, self.support_z_m, self.config.clouds)
        # A seed per id: the draws for one object do not depend on which others are seen.
        seeds = rng.integers(1 << 62, size=MAX_OBJECTS)
        rngs = {cloud.id: np.random.default_rng(seeds[cloud.id]) for cloud in clouds.objects}
        proposed = self.propose(scene, clouds, rngs)
        return each(
            lambda cloud: self._examined(proposed[cloud.id], cloud, clouds, volume, rngs[cloud.id]),
            clouds.objects,
        )

    def _examined(
        self,
        proposals: Proposals,
        cloud: ObjectCloud,
        clouds: SceneClouds,
        volume: OcclusionVolume,
        rng: np.random.Generator,
    ) -> CandidateSet:
        """Return those of an object's proposals that pass the checks, with their features and scores."""
        hand, z, raw, scores = self.hand, self.support_z_m, proposals.raw, proposals.scores
        found = check_candidates(raw, cloud, clouds.cells, hand, z, self.config.checks)
        keep = found.fault == Fault.NONE
        blocked, most = np.flatnonzero(keep & found.blocked), self.config.candidates.max_blocked
        if len(blocked) > most:
            keep[rng.permutation(blocked)[most:]] = False
        kept, foreign, camera = raw[keep], found.foreign[keep], clouds.camera_position
        features = compute_features(kept, foreign, cloud, clouds.cells, hand, volume, z, camera)
        behind = features[:, FEATURE_NAMES.index("contact_behind_tip")].astype(float)
        Ts = np.tile(np.eye(4), (len(kept), 1, 1))
        Ts[:, :3, :3], Ts[:, :3, 3] = kept.Rs, kept.tips
        middle = kept.tips - behind[:, None] * kept.Rs[:, :, 2]
        half = 0.5 * kept.widths_m[:, None] * kept.Rs[:, :, 0]
        grasps = GraspSet(
            Ts_world_tcp=Ts,
            widths_m=np.minimum(kept.widths_m, hand.max_width_m),
            scores=np.asarray(self.scorer.score(features), float) if scores is None else scores[keep],
            object_ids=np.full(len(kept), cloud.id, dtype=np.int16),
            contacts=np.stack([middle - half, middle + half], axis=1),
            generators=proposals.generators[keep],
            generator_names=self.generator_names,
        )
        return CandidateSet(grasps, features, found.blocked[keep], found.blockers[keep], len(raw))

    def _concatenated(self, parts: list[GraspSet]) -> GraspSet:
        """Concatenate several sets of grasps."""
        parts = parts or [NO_GRASPS]
        columns: dict[str, Any] = {n: np.concatenate([getattr(p, n) for p in parts]) for n in _COLUMNS}
        return GraspSet(**columns, generator_names=self.generator_names)


def _rows(grasps: GraspSet, index: np.ndarray) -> GraspSet:
    """Return the grasps of an index, in its order."""
    return replace(grasps, **{name: getattr(grasps, name)[index] for name in _COLUMNS})
