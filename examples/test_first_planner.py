"""The notebook runs from its first cell to its last."""

import json
import shutil
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.long
def test_the_notebook_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    shutil.copy(HERE / "frame.npz", tmp_path)
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((HERE / "first_planner.ipynb").read_text())
    names: dict[str, object] = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert "retrieved: True" in capsys.readouterr().out
