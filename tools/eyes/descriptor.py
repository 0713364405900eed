"""Training of the descriptor: what an object looks like, as a unit vector, the same from every side and in every light.

A crop of an object in clutter, partly hidden maybe and cut out by torc's own masks, is to be like one of the portraits
of that object alone, and unlike all portraits of all other objects of the batch, many of them of the same scene
(InfoNCE, van den Oord et al. 2018; of the portraits the nearest counts). Some objects take the colour of others of the
batch: only shape and pattern tell those apart.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Int16, Int64, UInt8
from torch import Tensor
from torch.nn import functional
from torch.utils.data import DataLoader, IterableDataset

from tools.eyes.collect import count_views, load_portraits, load_view, scene_files
from tools.eyes.measure import network_masks, true_label, whole_patch
from tools.eyes.network import Descriptor
from tools.eyes.shipped import shipped_descriptor
from tools.eyes.train import schedule
from torc.perception.embedded.model import SIDE_PX, crop, descriptor_inputs
from torc.perception.embedded.perception import uncut

_MIN_PIXELS = 60
_ALIKE = 6
"""So many objects of a batch take one colour."""
_GAINS = 0.4, 2.5
"""A darker or a lighter thing would be mostly noise."""


@dataclass(frozen=True)
class SceneCrops:
    """All crops of one scene's views, of which object each is, and portraits of each object by id and side."""

    crops: UInt8[np.ndarray, "n s s 4"]
    object_ids: Int64[np.ndarray, "n"]
    portraits: UInt8[np.ndarray, "m k s s 4"]


def scene_crops(path: Path) -> SceneCrops:
    """The crops of a scene's file: by the masks that torc finds with exact depth and with depth from a stereo pair, and
    by the true ones.
    """
    crops, ids = [np.zeros((0, SIDE_PX, SIDE_PX, 4), np.uint8)], []
    for index in range(count_views(path)):
        view = load_view(path, index)
        true = true_label(view)
        patch = whole_patch(view, stereo=index % 3 != 0)
        found = uncut(network_masks(patch), patch.window, true.shape)
        for k in np.unique(true[true >= 0]).tolist():
            for mask in (true == k, best_mask(found, true == k)):
                if np.count_nonzero(mask) >= _MIN_PIXELS:
                    crops.append(crop(view.rgb, mask)[None])
                    ids.append(k)
    return SceneCrops(np.concatenate(crops), np.array(ids, np.int64), load_portraits(path))


def best_mask(found: Int16[np.ndarray, "h w"], true: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """The mask that shows most of an object, if most of it is that object's."""
    inside = found[true & (found >= 0)]
    if len(inside) == 0:
        return np.zeros_like(true)
    mask = found == np.bincount(inside.astype(np.int64)).argmax()
    return mask if np.count_nonzero(mask & true) > 0.5 * np.count_nonzero(mask) else np.zeros_like(mask)


def save_crops(scenes: Path, out: Path) -> list[Path]:
    """Cuts out the objects of all scenes of a directory, a file per scene; those that are there stay."""
    out.mkdir(parents=True, exist_ok=True)
    for path in scene_files(scenes):
        if not (out / path.name).exists():
            np.savez(out / path.name, **vars(scene_crops(path)))
    return sorted(out.glob("scene_*.npz"))


@dataclass(frozen=True)
class DescriptorConfig:
    """How it is trained: in each step `scenes` scenes, of each up to `objects` objects, a crop and all portraits."""

    steps: int = 8000
    scenes: int = 10
    objects: int = 6
    rate: float = 2e-3
    warm_up: int = 500
    temperature: float = 0.07
    alike: float = 0.1
    """Share of the objects that take the colour of others."""
    shipped: bool = False
    """Begin with the descriptor that torc ships, instead of with nothing."""
    seed: int = 1


class Batches(IterableDataset):  # type: ignore[type-arg]
    """Batches of crops (n) and the portraits of their objects (n, sides) without end."""

    def __init__(self, files: list[Path], config: DescriptorConfig) -> None:
        self.files, self.config = files, config

    def __iter__(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        rng = np.random.default_rng(self.config.seed)
        scenes = [SceneCrops(**dict(np.load(f))) for f in self.files]
        while True:
            pictures = []
            for s in rng.choice(len(scenes), self.config.scenes, replace=False):
                scene = scenes[s]
                for k in rng.permutation(np.unique(scene.object_ids))[: self.config.objects]:
                    mine = np.flatnonzero(scene.object_ids == k)
                    pictures.append(np.concatenate([scene.crops[rng.choice(mine)][None], scene.portraits[k]]))
            pictures = alike(pictures, self.config.alike, rng)
            crops = [varied(p[0], rng) for p in pictures]
            portraits = [relit(side, rng) for p in pictures for side in p[1:]]
            yield descriptor_inputs(np.stack(crops)), descriptor_inputs(np.stack(portraits))


def alike(
    pictures: list[UInt8[np.ndarray, "k s s 4"]], share: float, rng: np.random.Generator
) -> list[UInt8[np.ndarray, "k s s 4"]]:
    """The pictures, of which a share takes the mean colour of other objects: six at a time the same one."""
    means = [p[1:][p[1:, ..., 3] > 0][:, :3].mean(axis=0) for p in pictures]
    changed = rng.permutation(len(pictures))[: round(share * len(pictures))]
    out = list(pictures)
    for start in range(0, len(changed), _ALIKE):
        wanted = means[rng.integers(len(means))]
        for k in changed[start : start + _ALIKE]:
            out[k] = painted(pictures[k], means[k], wanted)
    return out


def painted(
    picture: UInt8[np.ndarray, "k s s 4"], mean: Float[np.ndarray, "3"], wanted: Float[np.ndarray, "3"]
) -> UInt8[np.ndarray, "k s s 4"]:
    """The same thing in another paint, of that mean colour: shadows and patterns get darker or lighter with it."""
    gain = np.clip(wanted / np.maximum(mean, 1), *_GAINS)
    color = picture[..., :3] * gain + (wanted - gain * mean)
    out = np.concatenate([np.clip(color, 0, 255).astype(np.uint8), picture[..., 3:]], axis=-1)
    out[picture[..., 3] == 0] = 0
    return out


def varied(picture: UInt8[np.ndarray, "s s 4"], rng: np.random.Generator) -> UInt8[np.ndarray, "s s 4"]:
    """The crop in another light, with a mask that is a little off or partly hidden."""
    side = picture.shape[0]
    M = np.asarray(cv2.getRotationMatrix2D((side / 2, side / 2), rng.normal(0, 15), rng.uniform(0.85, 1.1)))
    M[:, 2] = M[:, 2] + rng.normal(0, 2, 2)
    out = np.asarray(cv2.warpAffine(picture, M, (side, side), flags=cv2.INTER_LINEAR))
    mask = out[..., 3]
    if rng.random() < 0.3:
        mask = np.asarray(cv2.erode(mask, np.ones((3, 3), np.uint8)))
    if rng.random() < 0.25:  # something in front
        x, y = rng.integers(0, side, 2)
        turn = rng.uniform(0, 2 * np.pi)
        rows, cols = np.mgrid[:side, :side]
        hidden = (cols - x) * np.cos(turn) + (rows - y) * np.sin(turn) > 0
        if np.count_nonzero(mask[~hidden]) > 0.3 * np.count_nonzero(mask):
            mask = np.where(hidden, 0, mask).astype(np.uint8)
    if rng.random() < 0.3:
        out = np.asarray(cv2.GaussianBlur(out, (0, 0), float(rng.uniform(0.5, 1.3))))
    return relit(np.dstack([out[..., :3], mask]), rng)


def relit(picture: UInt8[np.ndarray, "s s 4"], rng: np.random.Generator) -> UInt8[np.ndarray, "s s 4"]:
    """The picture in another light, with noise."""
    color, mask = picture[..., :3].astype(np.float32) / 255, picture[..., 3]
    color = np.clip(color * rng.uniform(0.8, 1.2) * rng.uniform(0.95, 1.05, 3), 0, 1) ** rng.uniform(
        0.85, 1.2
    )
    color = color + rng.uniform(0, 0.03) * rng.standard_normal(color.shape)
    out = np.dstack([np.clip(color, 0, 1) * 255, mask]).astype(np.uint8)
    out[mask == 0] = 0
    return out


def loss_of(crops: Tensor, portraits: Tensor, temperature: float) -> tuple[Tensor, float]:
    """The loss, and the share of crops (n, d) whose own portraits (n * k, d) are the nearest."""
    logits = (crops @ portraits.T / temperature).view(len(crops), len(crops), -1).logsumexp(dim=2)
    wanted = torch.arange(len(crops))
    right = float((logits.detach().argmax(1) == wanted).float().mean())
    loss = 0.5 * (functional.cross_entropy(logits, wanted) + functional.cross_entropy(logits.T, wanted))
    return loss, right


def train_descriptor(files: list[Path], out: Path, config: DescriptorConfig | None = None) -> None:
    """Trains on files of scenes' crops to `out`, which is written ever again; goes on from there."""
    config = config or DescriptorConfig()
    torch.manual_seed(config.seed)
    net = shipped_descriptor(_some(files, config)) if config.shipped and not out.exists() else Descriptor()
    net.train()
    optimizer = torch.optim.AdamW(net.parameters(), config.rate, weight_decay=0.02)
    start = 0
    if out.exists():
        state = torch.load(out, weights_only=True)
        start = state["step"]
        net.load_state_dict(state["net"])
        optimizer.load_state_dict(state["optimizer"])
    batches = Batches(files, replace(config, seed=config.seed + start))
    loader = DataLoader(batches, batch_size=None, num_workers=1, prefetch_factor=4)
    began, loss_sum, right_sum = time.time(), 0.0, 0.0
    for step, (crops, portraits) in zip(range(start + 1, config.steps + 1), loader):
        for group in optimizer.param_groups:
            group["lr"] = config.rate * schedule(step - 1, config.steps, config.warm_up)
        with torch.autocast("cpu", torch.bfloat16):
            found = net(torch.cat([crops, portraits]))
        loss, right = loss_of(found[: len(crops)].float(), found[len(crops) :].float(), config.temperature)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        loss_sum, right_sum = loss_sum + float(loss.detach()), right_sum + right
        if step % 100 == 0:
            spent = (time.time() - began) / (step - start)
            print(
                f"step {step}: loss {loss_sum / 100:.3f}, right {right_sum / 100:.3f}, {spent:.2f} s",
                flush=True,
            )
            loss_sum = right_sum = 0.0
        if step % 500 == 0 or step == config.steps:
            state = {"step": step, "net": net.state_dict(), "optimizer": optimizer.state_dict()}
            torch.save(state, out.with_suffix(".part"))
            out.with_suffix(".part").rename(out)


def _some(files: list[Path], config: DescriptorConfig) -> Tensor:
    """Inputs by which the statistics of the shipped descriptor are measured."""
    crops, portraits = next(iter(Batches(files, config)))
    return torch.from_numpy(np.concatenate([crops, portraits]))
