"""One seed decides everything: each stage of each pick draws from its own stream."""

import zlib

import numpy as np


def stage_rng(seed: int, pick: int, stage: str) -> np.random.Generator:
    """Generator for one stage of one pick.

    Streams are independent of each other, so a stage that draws more numbers changes no other stage.
    """
    return np.random.default_rng([seed, pick, zlib.crc32(stage.encode())])
