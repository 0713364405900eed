"""Made-up trials for tests: two informative features of five."""

import numpy as np

from tools.grasp_model.dataset import Cause, Policy, Trials

NAMES = ("extent", "contacts", "noise_a", "noise_b", "noise_c")


def make_trials(count: int, seed: int, scenes: int = 20, first_scene: int = 0, collection: int = 0) -> Trials:
    """`count` trials in `scenes` scenes; held with probability logistic(2 extent + contacts)."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((count, len(NAMES))).astype(np.float32)
    held = rng.random(count) < 1 / (1 + np.exp(-(2 * x[:, 0] + x[:, 1])))
    scene = first_scene + np.sort(rng.integers(0, scenes, count))
    failures = rng.integers(Cause.STOPPED, Cause.BROKEN, count)
    return Trials(
        features=x,
        feature_names=NAMES,
        delivered=held,
        cause=np.where(held, Cause.DELIVERED, failures).astype(np.uint8),
        policy=rng.integers(0, len(Policy), count).astype(np.uint8),
        scene=scene.astype(np.int64),
        stage=np.zeros(count, np.uint8),
        seed=np.full(count, collection, np.int64),
        object_id=rng.integers(0, 5, count).astype(np.int16),
        kind=rng.choice(["mug", "book", "can"], count),
        structured=scene % 2 == 0,
        held_out=rng.random(count) < 0.2,
        eyes=rng.integers(0, 5, count).astype(np.uint8),
        valid=np.ones(count, bool),
        generator=np.zeros(count, np.uint8),
        p_hand=(1 / (1 + np.exp(-x[:, 1]))).astype(np.float32),
        T_world_tcp=np.tile(np.eye(4), (count, 1, 1)),
        width_m=np.full(count, 0.04, np.float32),
        pixel_count=np.full(count, 500, np.int32),
        others_moved=np.zeros(count, np.uint8),
        others_dropped=np.zeros(count, np.uint8),
    )
