"""Recorded trials without physics, and a server over them."""

import shutil
from pathlib import Path

import pytest
from page_server import served

from tests.helpers.fake_trial import play_fake_trial
from torc.specs.trial import TrialSpec
from torc.task_planning.registry import make_planner


@pytest.fixture(scope="session")
def _recorded(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("recorded") / "boxes"
    return play_fake_trial(TrialSpec.of("boxes", "dg-select"), out, make_planner("dg-select")).directory


@pytest.fixture
def recorded(_recorded, tmp_path) -> Path:
    """A directory with one recorded trial, `boxes`: pick 1, then the target; a test may change it."""
    shutil.copytree(_recorded, tmp_path / "trials" / "boxes")
    return tmp_path / "trials"


@pytest.fixture
def client(recorded):
    """The viewer of the recorded trial."""
    with served(recorded) as found:
        yield found
