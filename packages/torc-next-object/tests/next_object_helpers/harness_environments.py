"""The environments that scripts/harnesses makes, in which other people's evaluation harnesses run."""

import json
import os
import subprocess
from pathlib import Path

import pytest

VARIABLE = "TORC_HARNESSES"
ROOT = Path(__file__).parents[4]


def harness_python(name: str) -> Path:
    """The interpreter of a harness's environment; skips the test where there is none."""
    home = os.environ.get(VARIABLE)
    if not home:
        pytest.skip(f"{VARIABLE} does not name the environments of scripts/harnesses")
    python = Path(home) / name / "bin" / "python"
    if not python.exists():
        pytest.skip(f"{name} is not installed in {home}; scripts/harnesses installs it")
    return python


def run_in_harness(
    name: str, arguments: list[str], tmp_path: Path, more_paths: tuple[Path, ...] = (), **variables: str
) -> dict:
    """Runs a module or script there; the JSON on its last line."""
    packages = [p / name for p in (ROOT / "packages").iterdir() for name in ("src", "tests")]
    paths = os.pathsep.join(map(str, (*more_paths, ROOT / "src", *packages, ROOT)))
    environment = {
        **{k: v for k, v in os.environ.items() if "API_KEY" not in k},
        "PYTHONPATH": paths,
        "HF_HUB_OFFLINE": "1",
        "HF_HOME": str(tmp_path / "hf"),
        "NO_COLOR": "1",
        **variables,
    }
    done = subprocess.run(
        [harness_python(name), *arguments],
        env=environment,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=400,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-6000:]
    return json.loads(done.stdout.strip().splitlines()[-1])
