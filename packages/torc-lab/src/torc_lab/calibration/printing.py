"""What is printed for a calibration: the board, and the marker for the table."""

from collections.abc import Iterable
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from torc import InputError
from torc_lab.calibration.board import Board
from torc_lab.calibration.marker import MARKER_M, marker_picture

_MARGIN_M = 0.02
_A4_M = (0.297, 0.210)


def write_board(board: Board, path: Path, dpi: int = 600) -> list[Path]:
    """The board as a page to print, A4 or larger, with a line of 100 mm to be measured, and a page with the marker for
    the table: the second of a .pdf, a file of its own beside a .png. Returns the files. Raises InputError.
    """
    kind = path.suffix.lower()
    if kind not in (".pdf", ".png"):
        raise InputError(f"The board is written as .pdf or .png, not '{path.suffix}'.")
    pages = _board_page(board, dpi), _marker_page(dpi)
    if kind == ".pdf":
        pages[0].save(path, resolution=dpi, save_all=True, append_images=[pages[1]])
        return [path]
    beside = path.with_name(f"{path.stem}_marker{path.suffix}")
    for page, file in zip(pages, (path, beside), strict=True):
        page.save(file, dpi=(dpi, dpi))
    return [path, beside]


def _board_page(board: Board, dpi: int) -> Image.Image:
    per_m = dpi / 0.0254
    sheet = _sheet((max(a, b + 2 * _MARGIN_M) for a, b in zip(_A4_M, board.size_m)), per_m)
    picture = Image.fromarray(board.picture(per_m))
    left, top = (sheet.width - picture.width) // 2, (sheet.height - picture.height) // 2
    sheet.paste(picture, (left, top))
    line = top + picture.height + round(0.007 * per_m)
    ImageDraw.Draw(sheet).line(
        [(left, line), (left + round(0.1 * per_m), line)], fill=0, width=round(0.0004 * per_m)
    )
    told = (
        f"This line is 100 mm long, each square {1e3 * board.square_m:g} mm. Print at 100 %, glue it to something "
        "flat, and measure both."
    )
    _write(sheet, told, left, line + round(0.002 * per_m), per_m)
    return sheet


def _marker_page(dpi: int) -> Image.Image:
    per_m = dpi / 0.0254
    sheet = _sheet(_A4_M, per_m)
    picture = Image.fromarray(marker_picture(round(MARKER_M * per_m)))
    left, top = (sheet.width - picture.width) // 2, (sheet.height - picture.height) // 2
    sheet.paste(picture, (left, top))
    told = (
        "Tape this to the table, in sight of the camera and out of the way, before you calibrate: by it torc notices "
        "that the camera has moved."
    )
    _write(sheet, told, round(_MARGIN_M * per_m), top + picture.height + round(0.015 * per_m), per_m)
    return sheet


def _sheet(size_m: Iterable[float], per_m: float) -> Image.Image:
    width, height = (round(v * per_m) for v in size_m)
    return Image.new("L", (width, height), 255)


def _write(sheet: Image.Image, text: str, left: int, top: int, per_m: float) -> None:
    ImageDraw.Draw(sheet).text((left, top), text, fill=0, font=ImageFont.load_default(round(0.0035 * per_m)))
