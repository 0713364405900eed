"""`torc objects sheet`: pages with the right pictures on them, and clear errors."""

from pathlib import Path

import pytest
from PIL import Image

from torc.cli import object_sheet
from torc.cli.object_sheet import SheetCommand


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
