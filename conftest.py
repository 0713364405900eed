"""Fixtures that all tests share."""

from pathlib import Path

import jaxtyping
import numpy as np
import pytest

from tests.helpers.shapes import check_annotations

check_annotations()  # before torc's modules are imported

from torc.robots.description import RobotDescription  # noqa: E402
from torc.robots.loading import load_robot  # noqa: E402
from torc.workspace.description import Workspace  # noqa: E402
from torc.workspace.workspace_files import load_workspace  # noqa: E402


@pytest.fixture(autouse=True)
def object_store(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty store of one's own objects: the tests do not see those of whoever runs them."""
    store = tmp_path / "objects"
    monkeypatch.setenv("TORC_OBJECTS", str(store))
    return store


@pytest.fixture
def any_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    """Annotations are not checked: for tests of what torc itself says of wrong arrays."""
    monkeypatch.setattr(jaxtyping.config, "jaxtyping_disable", True)


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded generator: tests are the same every time."""
    return np.random.default_rng(20260101)


@pytest.fixture(scope="session")
def robot() -> RobotDescription:
    """The shipped robot."""
    return load_robot()


@pytest.fixture(scope="session")
def workspace() -> Workspace:
    """The default table, bin and camera."""
    return load_workspace()


@pytest.fixture
def theirs(tmp_path, monkeypatch):
    """Writes a class of somebody's with that method; returns its name."""

    def write(method, code):
        module = f"part_{abs(hash((method, code)))}"
        lines = ["class Theirs:", "    name = 'theirs'", f"    def {method}:", f"        {code}"]
        (tmp_path / f"{module}.py").write_text("\n".join(lines) + "\n")
        monkeypatch.syspath_prepend(tmp_path)
        return f"{module}:Theirs"

    return write
