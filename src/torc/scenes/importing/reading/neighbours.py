"""The files that a mesh file names: its materials and textures."""

from pathlib import Path

_MAX_BYTES = 300 * 2**20


class Neighbours:
    """Plain files below one directory, no others.

    Readers go on without what is not to be had; what was refused or missing is written down here.
    """

    def __init__(self, directory: Path, root: Path) -> None:
        self._directory, self._root, self._left = directory.resolve(), root.resolve(), _MAX_BYTES
        self.refused: list[str] = []
        self.missing: list[str] = []
        self._read: dict[Path, bytes] = {}

    def read(self, name: str) -> bytes | None:
        """The content of a file named in the mesh or its materials; None if it is refused or missing."""
        name = name.strip().strip('"')
        if not name:
            return None
        path = self._inside(name)
        if path is None:
            self.refused.append(f"it names '{name[:120]}', which is not below {self._root}")
            return None
        if path in self._read:
            return self._read[path]
        size = _size(path)
        if size is None:
            self.missing.append(name[:120])
            return None
        if size > self._left:
            self.refused.append(f"with '{name[:120]}' it is more than {_MAX_BYTES // 2**20} MB")
            return None
        try:
            data = path.read_bytes()
        except OSError as error:
            self.refused.append(f"'{name[:120]}', which it names, cannot be opened ({error.strerror})")
            return None
        self._left -= len(data)
        self._read[path] = data
        return data

    def _inside(self, name: str) -> Path | None:
        """Where it is, links followed; None outside of the root."""
        relative = name.replace("\\", "/")
        if not relative or "\0" in relative or ":" in relative or relative.startswith(("/", "~")):
            return None
        try:
            path = (self._directory / relative).resolve()
        except (OSError, RuntimeError, ValueError):
            return None
        return path if path.is_relative_to(self._root) else None


def _size(path: Path) -> int | None:
    """Bytes of a plain file; None if there is none, or no file can have the name."""
    try:
        return path.stat().st_size if path.is_file() else None
    except OSError:
        return None
