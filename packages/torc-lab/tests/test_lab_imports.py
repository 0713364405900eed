"""Heavy libraries are imported when they are used, not before."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("module", "libraries"),
    [
        ("torc_lab.cameras.kinds", {"pyrealsense2", "pyzed", "websockets"}),
        ("torc_lab.cameras.ros", {"websockets"}),
        ("torc_lab.robotiq.wires", {"pymodbus", "serial"}),
        ("torc_lab.ur.arm", {"rtde_control", "rtde_receive"}),
    ],
)
def test_importing_a_module_needs_none_of_these_libraries(module, libraries):
    probe = f"import sys, {module}; print({libraries} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "set()"
