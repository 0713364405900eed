"""Reading and writing frames, whatever their form."""

from pathlib import Path
from types import MappingProxyType

import numpy as np

from torc.errors import InputError
from torc.pipeline.frames.directory_form import read_directory, write_directory
from torc.pipeline.frames.labels import label_ids
from torc.pipeline.frames.npz_form import read_npz, write_npz
from torc.pipeline.frames.plausibility import check_camera, check_range, clean_depth, support_height
from torc.pipeline.frames.record import Frame, RawFrame
from torc.pipeline.frames.support_plane import grid_around, object_points
from torc.pipeline.frames.values import as_grid, as_names, as_text, check_regular
from torc.records import TARGET_ID, Observation


def load_frame(path: str | Path) -> Frame:
    """The frame at a .npz file or directory; the package's text says what they hold.

    Labels keep their numbers where those are 1..63; the target becomes 0, and every other object gets the lowest id
    that is free. Raises InputError, naming file, key and remedy, for whatever cannot be used.
    """
    raw = _read_raw(Path(path))
    depth_m = clean_depth(raw)
    check_camera(raw)
    labels = label_ids(raw)
    observation = Observation(
        rgb=raw.rgb,
        depth_m=depth_m,
        K=raw.K,
        T_world_camera=raw.T_world_camera,
        qpos=np.zeros(0),
        stamp_s=0.0,
        label_image=labels.label_image,
    )
    check_range(raw, observation)
    support_z_m, estimated = support_height(raw, observation)
    points, grid = object_points(observation), raw.settings.get("grid")
    names = as_names(raw.key("names"), raw.settings.get("names", {}))
    return Frame(
        observation=observation,
        target_id=TARGET_ID if labels.target_visible else None,
        target_description=as_text(raw.key("target_description"), raw.settings.get("target_description", "")),
        support_z_m=support_z_m,
        grid=grid_around(points, support_z_m) if grid is None else as_grid(raw.key("grid"), grid),
        labels=MappingProxyType({i: label for label, i in labels.ids.items()}),
        names=MappingProxyType({labels.ids[k]: name for k, name in names.items() if k in labels.ids}),
        support_estimated=estimated,
    )


def save_frame(path: str | Path, frame: Frame) -> None:
    """Writes a frame: a .npz file if the path ends so, else a directory, which is made.

    Labels are written as object ids. A directory rounds depth to 0.1 mm; a .npz file has no names. Raises InputError
    if it cannot be written, or has no label image.
    """
    path, label = Path(path), frame.observation.label_image
    if label is None:
        raise InputError("A frame without a label image cannot be saved.")
    try:
        if path.suffix == ".npz":
            write_npz(path, frame, label)
        else:
            write_directory(path, frame, label)
    except OSError as error:
        raise InputError(f"Cannot write the frame to '{path}': {error}.") from error


def _read_raw(path: Path) -> RawFrame:
    """The frame at a .npz file or directory. Raises InputError where it cannot be read."""
    if path.is_dir():
        raw = read_directory(path)
    elif not path.exists():
        raise InputError(f"There is no frame '{path}'. Give a .npz file, or a directory with frame.json.")
    elif path.suffix == ".npz":
        check_regular(path)
        raw = read_npz(path)
    else:
        raise InputError(
            f"'{path}' is neither a .npz file nor a directory with rgb.png, depth.png, labels.png, frame.json."
        )
    shapes = {"rgb": raw.rgb.shape[:2], "depth": raw.depth_m.shape, "labels": raw.labels.shape}
    if len(set(shapes.values())) != 1:
        sizes = ", ".join(f"{k} {s[1]}x{s[0]}" for k, s in shapes.items())
        raise InputError(f"{raw.where}: image sizes differ ({sizes}). Register all three to one camera.")
    return raw
