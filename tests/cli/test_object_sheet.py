"""`torc objects sheet`: pages with the right pictures on them, and clear errors."""

from pathlib import Path

import pytest
from PIL import Image

from torc.cli import object_sheet
from torc.cli.object_sheet import SheetCommand
from torc.errors import InputError


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


@pytest.mark.parametrize(
    ("name", "out", "message"),
    [
        ("mug_rde", "sheet.png", "Did you mean 'mug_red'"),
        ("die_red", "sheet.xyz", "written as .jpg or .png"),
        ("die_red", "file/sheet.png", "cannot be written"),
    ],
)
def test_mistakes_are_named_before_anything_is_drawn(
    name: str, out: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("not a directory")
    monkeypatch.setattr(object_sheet, "contact_sheets", lambda *_: pytest.fail("drawn"))
    with pytest.raises(InputError, match=message):
        SheetCommand((name,), tmp_path / out).run()
