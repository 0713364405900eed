"""Tiny networks with random weights, made once, and no way to the hub."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from network_helpers.tiny_sam import SAVERS, import_torchvision
from torc.perception.target import Certainty
from torc_networks.proposals import LayoutConfig
from torc_networks.sam.network import GROUNDING_DINO, SAM2, SAM3, Runtime, load_network
from torc_networks.sam.perception import (
    GroundedSam2Config,
    GroundedSam2Perception,
    Sam3Config,
    Sam3Perception,
)

ANY = LayoutConfig(rising_share=0.0, most_share=1.0, left=0.05)
"""Random masks lie anywhere."""


@pytest.fixture(scope="session")
def torch():
    """torch, with transformers and torchvision beside it; they are imported once, which takes seconds."""
    found = pytest.importorskip("torch", reason="the extra `sam` is not installed: no torch")
    pytest.importorskip("transformers", reason="the extra `sam` is not installed: no transformers")
    try:
        import_torchvision()
    except ImportError:
        pytest.skip("the extra `sam` is not installed: no torchvision")
    return found


@pytest.fixture(scope="session")
def tiny(torch, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """The folder of a tiny network by its name, see `network_helpers.tiny_sam.SAVERS`."""
    made: dict[str, Path] = {}

    def folder(name: str) -> str:
        if name not in made:
            made[name] = tmp_path_factory.mktemp(name)
            SAVERS[name](made[name])
        return str(made[name])

    return folder


@pytest.fixture(autouse=True)
def _offline(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hub is out of reach, whether its library was imported before or is imported now."""
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    if "huggingface_hub" in sys.modules:
        from huggingface_hub import constants

        monkeypatch.setattr(constants, "HF_HUB_OFFLINE", True)


@pytest.fixture
def rgb(rng):
    return rng.integers(0, 256, (96, 128, 3), np.uint8)


@pytest.fixture
def dino(tiny):
    return load_network(GROUNDING_DINO, tiny("dino"), Runtime())


@pytest.fixture
def sam2(tiny):
    return load_network(SAM2, tiny("sam2"), Runtime())


@pytest.fixture
def sam3(tiny):
    return load_network(SAM3, tiny("sam3"), Runtime())


@pytest.fixture
def grounded(tiny):
    """Makes the paper's perception."""

    def make(**settings):
        config = GroundedSam2Config(detector=tiny("dino"), segmenter=tiny("sam2"), layout=ANY)
        return GroundedSam2Perception(replace(config, **settings))

    return make


@pytest.fixture
def concepts(tiny):
    """Makes SAM 3's; scores of random weights are about a quarter."""

    def make(**settings):
        config = Sam3Config(
            weights=tiny("sam3"), layout=ANY, object_score=0.1, words=Certainty(0.1, 0.0, 0.0)
        )
        return Sam3Perception(replace(config, **settings))

    return make
