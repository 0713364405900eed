"""Records with arrays, read from files that may come from strangers."""

import typing
import zipfile
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import AbstractArray, jaxtyped

from torc.errors import InputError
from torc.records.serialization import load_record

Record = TypeVar("Record")


def load_checked(path: Path, cls: type[Record], max_bytes: int, what: str) -> Record:
    """The record that `save_record` wrote: its arrays are of the annotated types and shapes, and finite.

    Nothing is unpacked before its size is known. `what` names the content for messages.

    Raises:
        InputError: missing, damaged, too large, or with arrays that do not fit each other.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (OSError, zipfile.BadZipFile) as error:
        raise InputError(f"'{path}' is not a readable {what}: {error}") from error
    if size > max_bytes:
        raise InputError(f"'{path}' is larger than {max_bytes // 2**20} MB unpacked.")
    record = load_record(path, cls)
    if not _fits(record):
        raise InputError(f"'{path}' holds no {what}: its arrays are not as torc writes them.")
    return record


def _fits(record: Any) -> bool:
    """Whether a record's arrays are as annotated, sizes of the same name alike, and so in the records within."""
    with jaxtyped("context"):
        for name, kind in typing.get_type_hints(type(record)).items():
            value = getattr(record, name)
            if not isinstance(kind, type):
                continue
            if is_dataclass(kind) and not (isinstance(value, kind) and _fits(value)):
                return False
            if issubclass(kind, AbstractArray) and not (isinstance(value, kind) and _finite(value)):
                return False
    return True


def _finite(array: Any) -> bool:
    return bool(np.isfinite(array).all())
