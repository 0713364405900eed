"""Text of mesh files: one encoding, one kind of line end."""

import codecs

import numpy as np
from jaxtyping import Float


def plain_text(data: bytes) -> bytes:
    """Without marks, in UTF-8 if it was in UTF-16, lines ended by a newline, words parted by spaces."""
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        data = data.decode("utf-16", "replace").encode()
    data = data.removeprefix(codecs.BOM_UTF8)
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\t", b" ")


def without_comment(text: bytes) -> bytes:
    """A line, or the rest of one, up to a comment: a # that begins a word."""
    return (b" " + text).split(b" #", 1)[0].strip()


def named_file(text: bytes) -> bytes:
    """A file's name and what stands before it, without a comment: what lies before a # has an ending of its own."""
    before = without_comment(text)
    return before if b"." in before.rsplit(b" ", 1)[-1] else text.strip()


def number_rows(rows: list[bytes], columns: int) -> Float[np.ndarray, "n c"]:
    """The first so many numbers of each row; those that are missing are not a number. Raises ValueError."""
    lengths = np.fromiter((len(row.split()) for row in rows), np.int64, len(rows))
    numbers = np.full((len(rows), columns), np.nan)
    for length in np.unique(lengths[lengths > 0]):
        which = np.flatnonzero(lengths == length)
        words = b" ".join([rows[i] for i in which] if len(which) < len(rows) else rows).split()
        width = min(int(length), columns)
        numbers[which, :width] = _floats(words).reshape(-1, length)[:, :width]
    return numbers


def _floats(words: list[bytes]) -> Float[np.ndarray, "n"]:
    """Numbers; "-nan(ind)", "1.#QNAN" and the like are none. Raises ValueError for other words."""
    try:
        return np.array(words, dtype=np.float64)
    except ValueError:
        odd = (b"nan(", b"nan", b"#ind", b"#qnan", b"#inf", b"#snan")
        plain = [b"nan" if any(mark in word.lower() for mark in odd) else word for word in words]
        return np.array(plain, dtype=np.float64)
