"""The container of glTF 2.0's binary form: a header, then chunks (Khronos, glTF 2.0 Specification, section 4.4)."""

from collections.abc import Iterator
from pathlib import Path

from torc.errors import InputError

_VERSION = 2
_FILE_HEADER_BYTES, _CHUNK_HEADER_BYTES = 12, 8
_JSON, _BINARY = b"JSON", b"BIN\0"


def json_and_binary(data: bytes, path: Path) -> tuple[bytes, bytes]:
    """A file's JSON and its binary buffer, which may be empty. Chunks of other kinds are passed over.

    Raises:
        InputError: of another version, without JSON, or a chunk leaves the file.
    """
    version = int.from_bytes(data[4:8], "little")
    if version != _VERSION:
        raise InputError(
            f"{path} is glTF {version}; {_VERSION}.0 is read. Export it again with a newer program."
        )
    chunks = _chunks(data, path)
    kind, text = next(chunks, (b"", b""))
    if kind != _JSON:
        raise InputError(f"{path} is not a readable GLB file: it does not begin with JSON. Get it again.")
    return text, next((content for kind, content in chunks if kind == _BINARY), b"")


def _chunks(data: bytes, path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of each."""
    end, start = int.from_bytes(data[8:12], "little"), _FILE_HEADER_BYTES
    while start + _CHUNK_HEADER_BYTES <= end:
        size = int.from_bytes(data[start : start + 4], "little")
        kind = data[start + 4 : start + _CHUNK_HEADER_BYTES]
        start += _CHUNK_HEADER_BYTES
        if start + size > end:
            raise InputError(
                f"{path} is not a readable GLB file: it is cut off, a chunk of {size} bytes leaves it. Get it again."
            )
        yield kind, data[start : start + size]
        start += size
