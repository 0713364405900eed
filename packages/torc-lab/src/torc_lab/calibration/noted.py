"""What the calibration of a laboratory's camera noted."""

from pathlib import Path

from torc_lab.calibration.marker import TableMarker, marker_of_file
from torc_lab.lab_file import Lab


def is_calibrated(lab: Lab) -> bool:
    """Whether the lab file names a calibration as its camera's pose."""
    return _file(lab) is not None


def marker_of_lab(lab: Lab) -> TableMarker | None:
    """The marker on the table as the calibration saw it; None without one. Raises InputError."""
    path = _file(lab)
    return None if path is None else marker_of_file(path)


def _file(lab: Lab) -> Path | None:
    pose = lab.conditions.settings.get("camera.pose")
    path = Path(pose) if isinstance(pose, str) else None
    return path if path is not None and path.suffix in (".yaml", ".yml") and path.is_file() else None
