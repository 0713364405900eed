"""Heavy libraries are imported when they are used, not before."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("module", "libraries"),
    [
        ("torc_networks.client", {"zmq", "msgpack"}),
        # It runs in the environment of somebody's network.
        ("torc_networks.server", {"zmq", "msgpack", "scipy", "numba", "cv2", "mujoco", "pydantic"}),
        ("torc_networks.sam.perception", {"torch", "torchvision", "transformers", "onnxruntime"}),
    ],
)
def test_importing_a_module_needs_none_of_these_libraries(module, libraries):
    probe = f"import sys, {module}; print({libraries} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "set()"
