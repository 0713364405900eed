"""How well the shipped network segments views that nobody trained on."""

from dataclasses import astuple, fields
from pathlib import Path

import numpy as np
from jaxtyping import Int16

from tools.eyes.collect import BACKGROUND, SavedView, load_view, scene_files
from tools.eyes.samples import index_views
from torc.drawing.marking import Compared, mask_comparison
from torc.io.pictures import write_png
from torc.perception.embedded.inputs import PIXEL_M, Patch, View, Window, channels, cut
from torc.perception.embedded.instances import InstanceConfig, find_instances
from torc.perception.embedded.model import segment_patch
from torc.perception.embedded.perception import both_ways, uncut
from torc.perception.scoring import MaskScore, mean_score, score_masks

_SHOWN = 8


def network_masks(patch: Patch) -> np.ndarray:
    """The shipped network's masks."""
    out = both_ways(lambda inputs: segment_patch(inputs, 2), channels(patch))
    return find_instances(out[0], out[1:], InstanceConfig()).label


def whole_patch(saved: SavedView, stereo: bool) -> Patch:
    """All of a saved view, sides rounded up to multiples of 32."""
    z = float(np.median(saved.depth_m[saved.label != BACKGROUND]))
    scale = min(z / (saved.K[0, 0] * PIXEL_M), 1.3)
    height, width = (-(-int(np.ceil(n * scale)) // 32) * 32 for n in saved.label.shape)
    depth = saved.stereo_m if stereo else saved.depth_m
    view = View(saved.rgb, depth, saved.K, saved.T_world_camera, saved.support_z_m)
    return cut(view, Window(0, 0, scale), height, width)


def true_label(saved: SavedView) -> Int16[np.ndarray, "h w"]:
    """Object ids, -1 elsewhere."""
    return np.where(saved.label == BACKGROUND, -1, saved.label.astype(np.int16)).astype(np.int16)


def measure(directory: Path, every: int, worst: Path | None) -> None:
    """Prints a table: a line per method and depth."""
    views = index_views(scene_files(directory))[::every]
    names = [f.name for f in fields(MaskScore)]
    print(
        f"{directory}, {len(views)} views\n| masks, depth | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}"
    )
    shown: list[tuple[float, Compared]] = []
    for stereo in (False, True):
        scores = []
        for path, index in views:
            saved = load_view(path, index)
            patch = whole_patch(saved, stereo)
            label = uncut(network_masks(patch), patch.window, saved.label.shape)
            scores.append(score_masks(label, true_label(saved)))
            if worst is not None:
                shown.append((scores[-1].f75, (saved.rgb, true_label(saved), label)))
                shown = sorted(shown, key=lambda s: s[0])[:_SHOWN]
        numbers = " | ".join(f"{v:.3f}" for v in astuple(mean_score(scores)))
        print(f"| {'sgbm' if stereo else 'exact'} | {numbers} |", flush=True)
    if worst is not None:
        write_png(worst, mask_comparison([row for _, row in shown]))
