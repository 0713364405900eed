"""Write the pages to print for a calibration: the board, and the marker for the table."""

from pathlib import Path

from jaxtyping import UInt8
from numpy import ndarray
from PIL import Image, ImageDraw, ImageFont

from torc import InputError
from torc_lab.calibration.board import Board
from torc_lab.calibration.marker import MARKER_M, marker_picture

_MARGIN_M = 0.02
_A4_M = (0.297, 0.210)


def write_board(board: Board, path: Path, dpi: int = 600) -> list[Path]:
    """Write the board as a page to print, A4 or larger, and a page with the marker for the table.

    A .pdf holds both pages; with a .png the marker gets a file beside it. Both pages have a line of 100 mm to measure.
    Returns the files. Raises InputError for another suffix.
    """
    if path.suffix.lower() not in (".pdf", ".png"):
        raise InputError(f"The board is written as .pdf or .png, not '{path.suffix}'.")
    per_m = dpi / 0.0254
    width_m, height_m = (max(a, b + 2 * _MARGIN_M) for a, b in zip(_A4_M, board.size_m, strict=True))
    of_board = (
        f"Each square is {1e3 * board.square_m:g} mm wide: measure one, and glue the page to something flat."
    )
    of_marker = (
        "Tape this to the table, in sight of the camera and out of the way, before you calibrate: by it torc notices "
        "that the camera has moved."
    )
    pages = [
        _page(board.picture(per_m), of_board, (width_m, height_m), per_m),
        _page(marker_picture(round(MARKER_M * per_m)), of_marker, _A4_M, per_m),
    ]
    if path.suffix.lower() == ".pdf":
        pages[0].save(path, resolution=dpi, save_all=True, append_images=pages[1:])
        return [path]
    files = [path, path.with_name(f"{path.stem}_marker{path.suffix}")]
    for page, file in zip(pages, files, strict=True):
        page.save(file, dpi=(dpi, dpi))
    return files


def _page(pixels: UInt8[ndarray, "h w"], text: str, size_m: tuple[float, float], per_m: float) -> Image.Image:
    """Return a sheet with the picture in its middle, and below it a line of 100 mm and the text."""
    sheet = Image.new("L", (round(size_m[0] * per_m), round(size_m[1] * per_m)), 255)
    picture, draw = Image.fromarray(pixels), ImageDraw.Draw(sheet)
    top = (sheet.height - picture.height) // 2
    sheet.paste(picture, ((sheet.width - picture.width) // 2, top))
    left, line = round(_MARGIN_M * per_m), top + picture.height + round(0.007 * per_m)
    draw.line([(left, line), (left + round(0.1 * per_m), line)], fill=0, width=round(0.0004 * per_m))
    font = ImageFont.load_default(round(0.0035 * per_m))
    text = f"The line is 100 mm long if you print at 100 %. {text}"
    draw.text((left, line + round(0.002 * per_m)), text, fill=0, font=font)
    return sheet
