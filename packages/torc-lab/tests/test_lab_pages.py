"""The documentation names every camera and all its settings."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from torc.plugins import load_part
from torc.satellites import satellite_of_command
from torc.specs.settings import config_class
from torc.stages import CAMERAS

PAGE = (Path(__file__).parents[3] / "docs" / "cameras.md").read_text()
NAMES = satellite_of_command("lab").parts["torc.cameras"]


@pytest.mark.parametrize("name", NAMES)
def test_the_page_on_cameras_names_every_camera_and_its_settings(name):
    assert f"`{name}`" in PAGE
    names = {f.name for f in fields(config_class(load_part(CAMERAS, name)))}
    assert {n for n in names if not re.search(rf"`(camera\.)?{n}`|--camera\.{n}\b", PAGE)} == set()
