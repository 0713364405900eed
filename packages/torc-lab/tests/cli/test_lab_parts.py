"""Cameras and drivers in the help, and their settings."""

import pytest

from torc.cli.main import parse


def _help(capsys, *arguments):
    with pytest.raises(SystemExit):
        parse([*arguments, "--help"])
    return capsys.readouterr().out


def test_help_lists_cameras_and_in_commands_of_a_lab_drivers(capsys):
    text = _help(capsys, "run")
    assert "  zed-uvc " in text
    assert "motoman" not in text
    text = _help(capsys, "lab", "check")
    assert "`driver` of `arm` in the lab file: one of these" in text
    assert "  motoman " in text


@pytest.mark.parametrize(
    ("name", "line"), [("robotiq-modbus", "gripper.address"), ("zed-uvc", "--camera.calibration")]
)
def test_settings_of_drivers_and_cameras_are_listed(capsys, name, line):
    assert parse(["settings", name]).run() == 0
    assert any(shown.startswith(line) for shown in capsys.readouterr().out.splitlines())
