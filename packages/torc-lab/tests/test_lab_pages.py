"""The documentation names every camera and driver with all its settings, and every method of a driver."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from torc.registry.kinds import ARM_DRIVERS, CAMERAS, GRIPPER_DRIVERS
from torc.registry.loading import load_part
from torc.registry.settings import config_class
from torc.satellites import satellite_of_command
from torc_lab.protocols import (
    ArmDriver,
    ArmStatus,
    GripperDriver,
    NeedsActivation,
    PowersServos,
    SeesOtherJoints,
)

DOCS = Path(__file__).parents[3] / "docs"
PARTS = satellite_of_command("lab").parts


@pytest.mark.parametrize("name", PARTS[CAMERAS.group])
def test_the_page_on_cameras_names_every_camera_and_its_settings(name):
    text = (DOCS / "cameras.md").read_text()
    assert f"`{name}`" in text
    names = {f.name for f in fields(config_class(load_part(CAMERAS, name)))}
    assert {n for n in names if not re.search(rf"`(camera\.)?{n}`|--camera\.{n}\b", text)} == set()


@pytest.mark.parametrize("kind", [ARM_DRIVERS, GRIPPER_DRIVERS], ids=lambda kind: kind.what)
def test_the_page_on_the_laboratory_names_every_driver_and_its_settings(kind):
    text = (DOCS / "laboratory.md").read_text()
    for name in PARTS[kind.group]:
        assert f"| `{name}` |" in text
        settings = {f.name for f in fields(config_class(load_part(kind, name)))}
        assert {s for s in settings if f"`{s}`" not in text} == set()


def test_the_page_on_extending_names_every_member_of_the_drivers():
    text = (DOCS / "extending.md").read_text()
    protocols = (ArmDriver, PowersServos, SeesOtherJoints, GripperDriver, NeedsActivation)
    words = {m for p in protocols for part in p.__mro__ for m in vars(part) if not m.startswith("_")}
    words |= {field.name for field in fields(ArmStatus)}
    assert {w for w in words if not re.search(rf"`(\w+\()?{w}\b", text)} == set()
