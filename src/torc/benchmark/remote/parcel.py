"""A directory's files as data that travels between machines. What is unpacked never leads out of its directory."""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath

from torc.errors import InputError


@dataclass(frozen=True)
class Parcel:
    """The files below a directory.

    Attributes:
        files: path below the directory, with "/", and content.
        folders: those that hold nothing.
    """

    files: tuple[tuple[str, bytes], ...] = ()
    folders: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Bytes of content."""
        return sum(len(content) for _, content in self.files)


def pack(
    root: Path,
    *,
    wanted: Callable[[Path], bool] = lambda path: True,
    ends: Mapping[str, int] | None = None,
) -> Parcel:
    """What lies below a directory; links are left out.

    Args:
        root: the directory; nothing if it is not there.
        wanted: which files are taken, and which directories looked into.
        ends: by path, of how many bytes only the end of a file is taken.

    Raises:
        InputError: a name cannot be used on every system.
        OSError: something cannot be read.
    """
    files, folders = [], []
    for path in _below(root, wanted):
        name = _checked(path.relative_to(root).as_posix())
        if path.is_dir():
            folders.append(name)
        else:
            files.append((name, _end(path, (ends or {}).get(name))))
    return Parcel(tuple(files), tuple(folders))


def unpack(parcel: Parcel, root: Path) -> None:
    """Write the files into a new directory.

    Raises:
        InputError: a path leads out of the directory, or meets another; nothing was written outside.
        OSError: the directory is there already, or cannot be written.
    """
    names = [_checked(name) for name in (*parcel.folders, *(name for name, _ in parcel.files))]
    if len(set(names)) < len(names):
        raise InputError("A parcel holds two files of the same name.")
    root.mkdir(parents=True)
    for folder in parcel.folders:
        (root / folder).mkdir(parents=True, exist_ok=True)
    for name, content in parcel.files:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _below(root: Path, wanted: Callable[[Path], bool]) -> Iterator[Path]:
    """Files, and directories that hold nothing, sorted, so that equal directories make equal parcels."""
    for directory, names, files in os.walk(root):
        here = Path(directory)
        names[:] = sorted(n for n in names if not (here / n).is_symlink() and wanted(here / n))
        paths = [here / n for n in sorted(files)]
        yield from (p for p in paths if p.is_file() and not p.is_symlink() and wanted(p))
        if here != root and not names and not files:
            yield here


def _checked(name: str) -> str:
    """A path that stays below whatever it is put below, on every system. Raises InputError for others."""
    here, there = PurePosixPath(name), PureWindowsPath(name)
    plain = name not in ("", ".") and "\0" not in name and str(here) == name
    if not plain or here.is_absolute() or there.anchor or ".." in (*here.parts, *there.parts):
        raise InputError(f"A parcel holds the path {name!r}, which may lead out of its directory.")
    return name


def _end(path: Path, most: int | None) -> bytes:
    if most is None:
        return path.read_bytes()
    with open(path, "rb") as f:
        f.seek(max(0, path.stat().st_size - most))
        return f.read(most)
