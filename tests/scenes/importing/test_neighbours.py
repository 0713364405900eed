"""Files that a mesh names are plain ones below a directory."""

from pathlib import Path

import pytest

from torc.scenes.importing.reading.neighbours import Neighbours


def test_neighbours_are_plain_files_of_limited_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("torc.scenes.importing.reading.neighbours._MAX_BYTES", 1000)
    neighbours = Neighbours(tmp_path, tmp_path)
    (tmp_path / "small.mtl").write_bytes(b"x" * 600)
    assert neighbours.read("small.mtl") == b"x" * 600
    assert neighbours.read("./small.mtl") == b"x" * 600  # the same file counts once
    (tmp_path / "other.mtl").write_bytes(b"x" * 600)
    assert neighbours.read("other.mtl") is None  # together they are too much
    (tmp_path / "device").symlink_to("/dev/zero")
    assert neighbours.read("device") is None
    assert len(neighbours.refused) == 2


@pytest.mark.parametrize("name", ["p" * 300 + ".png", "d/" * 3000 + "p.png", "gone.png"])
def test_a_name_that_no_file_has_is_missing(name: str, tmp_path: Path) -> None:
    beside = Neighbours(tmp_path, tmp_path)
    assert beside.read(name) is None
    assert beside.missing == [name[:120]]
    assert beside.refused == []


@pytest.mark.parametrize("name", ["a\0b", "/etc/passwd", "~/x", "http://localhost/x", "../x", "..\\x"])
def test_names_that_lead_elsewhere_are_refused(name: str, tmp_path: Path) -> None:
    (tmp_path.parent / "x").write_bytes(b"secret")
    beside = Neighbours(tmp_path, tmp_path)
    assert beside.read(name) is None
    assert "which is not below" in beside.refused[0]
