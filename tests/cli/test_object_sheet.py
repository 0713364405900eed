"""`torc objects sheet`: pages with the right pictures on them, and clear errors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from torc.cli import object_sheet
from torc.cli.object_sheet import SheetCommand
from torc.errors import InputError
from torc.objects.files import save_object
from torc.objects.library import builtin_object_names, load_object, object_facts
from torc.objects.models import ObjectModel


def test_a_sheet_of_a_kind_and_an_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "new" / "sheet.png"
    assert SheetCommand(("die", "mug_red", "die_red"), path).run() == 0
    assert str(path) in capsys.readouterr().out
    with Image.open(path) as page:
        width, height = object_sheet.CELL
        assert page.size == (object_sheet.COLUMNS * width, height + object_sheet.CAPTION)
        middles = [page.getpixel((k * width + width // 2, height // 2)) for k in range(object_sheet.COLUMNS)]
        paper = (252, 252, 250)
        assert [m == paper for m in middles] == [False] * 4 + [True]  # three dice and a mug


def test_more_objects_than_fit_on_a_page_make_several(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(object_sheet, "COLUMNS", 2)
    monkeypatch.setattr(object_sheet, "ROWS", 1)
    assert SheetCommand(("die",), tmp_path / "s.jpg").run() == 0
    assert "page 2 of 2" in capsys.readouterr().out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["s-1.jpg", "s-2.jpg"]


def _own(store: Path, name: str, kind: str) -> None:
    save_object(replace(load_object("die_red"), name=name, kind=kind), store / name)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the objects whose portraits were made; nothing is drawn."""
    names: list[str] = []

    def fake(model: ObjectModel, width: int, height: int) -> np.ndarray:
        names.append(model.name)
        return np.zeros((height, width, 3), np.uint8)

    monkeypatch.setattr("torc.sim.portraits.portrait", fake)
    return names


def test_kinds_of_ones_own_can_be_asked_for(tmp_path: Path, object_store: Path, drawn: list[str]) -> None:
    for name, kind in (("thing_b", "thing"), ("thing_a", "thing"), ("cup", "mug")):
        _own(object_store, name, kind)
    assert SheetCommand(("thing",), tmp_path / "s.png").run() == 0
    assert drawn == ["thing_a", "thing_b"]
    assert SheetCommand(("mug", "thing_a"), tmp_path / "s.png").run() == 0
    mugs = [name for name in builtin_object_names() if object_facts(name).kind == "mug"]
    assert drawn[2:] == [*mugs, "cup", "thing_a"]


def test_damaged_objects_are_passed_over_and_told(
    tmp_path: Path, object_store: Path, drawn: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b", "c", "d"):
        _own(object_store, name, "thing")
    (object_store / "b" / "object.yaml").write_text("broken")
    (object_store / "c" / "geometry.npz").write_bytes(b"")
    assert SheetCommand(("thing", "b"), tmp_path / "s.png").run() == 0
    assert drawn == ["a", "d"]
    told = capsys.readouterr()
    assert [line for line in told.err.splitlines() if line.startswith("torc: ")] == told.err.splitlines()
    assert told.err.count(str(object_store / "b" / "object.yaml")) == 1
    assert told.err.count(str(object_store / "c" / "geometry.npz")) == 1
    assert "page 1 of 1" in told.out


def test_with_nothing_left_to_draw_there_is_no_sheet(tmp_path: Path, object_store: Path) -> None:
    _own(object_store, "a", "thing")
    (object_store / "a" / "geometry.npz").write_bytes(b"")
    with pytest.raises(InputError, match="None of these objects can be drawn"):
        SheetCommand(("a",), tmp_path / "s.png").run()
    assert not (tmp_path / "s.png").exists()
