"""Training: squares of random views, one after another, until the steps are done; it goes on where it was cut off."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from tools.eyes.collect import load_view, scene_files
from tools.eyes.network import Eyes
from tools.eyes.samples import SampleConfig, draw_sample, index_views
from tools.eyes.shipped import shipped_eyes
from torc.perception.embedded.instances import OFFSETS

_LOOK_AGAIN = 8000
"""After so many squares it is looked for new scenes."""
_MEASURED = 24
"""Squares by which the statistics of the shipped network are measured."""


@dataclass(frozen=True)
class TrainConfig:
    """How the network is trained.

    Attributes:
        steps, batch: weights change so often, each time by so many squares.
        rate, warm_up: highest learning rate, reached after so many steps; it falls to 0 as a half cosine.
        average: share of the old weights in their running average, which is what is kept.
        workers: processes that make samples.
        shipped: begin with the network that torc ships, instead of with nothing.
        device: cpu or cuda.
    """

    steps: int = 30_000
    batch: int = 8
    rate: float = 1.5e-3
    warm_up: int = 500
    decay: float = 0.02
    average: float = 0.999
    workers: int = 1
    seed: int = 1
    save_every: int = 500
    shipped: bool = False
    device: str = "cpu"


class Squares(IterableDataset):  # type: ignore[type-arg]
    """Random squares of a directory's scenes without end. Scenes that come to be while it runs are used, too."""

    def __init__(self, scenes: Path, seed: int, config: SampleConfig) -> None:
        self.scenes, self.seed, self.config = scenes, seed, config

    def __iter__(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        info = get_worker_info()
        rng = np.random.default_rng([self.seed, 0 if info is None else info.id])
        torch.set_num_threads(1)
        while True:
            views = index_views(scene_files(self.scenes))
            for _ in range(_LOOK_AGAIN):
                path, index = views[int(rng.integers(len(views)))]
                sample = draw_sample(load_view(path, index), rng, self.config)
                yield sample.inputs, sample.label


def loss_of(out: Tensor, label: Tensor) -> tuple[Tensor, Tensor]:
    """Losses of the object mask and of the affinities. Every object counts by the root of its size: small ones would
    be nothing beside large ones, and each is one object all the same."""
    weight = _weights(label)
    object_loss = functional.binary_cross_entropy_with_logits(
        out[:, 0], (label >= 0).float(), weight, reduction="sum"
    )
    object_loss = object_loss / weight.sum()
    total, count = out.new_zeros(()), 0
    for k, (dr, dc) in enumerate(OFFSETS, start=1):
        a, b = shifted(label, dr, dc)
        wa, wb = shifted(weight, dr, dc)
        logit, _ = shifted(out[:, k], dr, dc)
        same = ((a == b) & (a >= 0)).float()
        w = torch.maximum(wa, wb) * ((a >= 0) | (b >= 0)).float()
        # Both answers count alike.
        yes, no = (w * same).sum(), (w * (1 - same)).sum()
        w = w * torch.where(same > 0, 0.5 / yes.clamp(min=1), 0.5 / no.clamp(min=1))
        total = total + functional.binary_cross_entropy_with_logits(logit, same, w, reduction="sum")
        count += 1
    return object_loss, total / count


def shifted(x: Tensor, dr: int, dc: int) -> tuple[Tensor, Tensor]:
    """The part of each map (n, h, w) that has a partner at that offset, and the partners."""
    h, w = x.shape[-2:]
    c0, c1 = max(0, -dc), w - max(0, dc)
    return x[:, : h - dr, c0:c1], x[:, dr:, c0 + dc : c1 + dc]


def _weights(label: Tensor) -> Tensor:
    n = label.shape[0]
    flat = (label.long() + 1).flatten(1)
    one = torch.ones(1, device=label.device)
    area = torch.zeros(n, 258, device=label.device).scatter_add_(1, flat, one.expand(flat.shape))
    weight = (900.0 / area.clamp(min=1)).sqrt().clamp(0.4, 4.0)
    weight[:, 0] = 1.0
    return weight.gather(1, flat).view(label.shape)


def train(scenes: Path, out: Path, config: TrainConfig, samples: SampleConfig | None = None) -> None:
    """Trains to `out`, a file that is written ever again; goes on from there."""
    torch.manual_seed(config.seed)
    samples = samples or SampleConfig()
    net = shipped_eyes(_some(scenes, samples)) if config.shipped else Eyes()
    net = net.train().to(config.device, memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(net.parameters(), config.rate, weight_decay=config.decay)
    average = torch.optim.swa_utils.AveragedModel(
        net, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(config.average), use_buffers=True
    )
    start = 0
    if out.exists():
        state = torch.load(out, weights_only=True, map_location=config.device)
        start = state["step"]
        net.load_state_dict(state["net"])
        optimizer.load_state_dict(state["optimizer"])
        average.load_state_dict(state["average"])
    squares = Squares(scenes, config.seed + start, samples)
    loader = DataLoader(
        squares, config.batch, num_workers=config.workers, prefetch_factor=4 if config.workers else None
    )
    began, sums = time.time(), np.zeros(2)
    for step, (inputs, label) in enumerate(loader, start=start):
        if step >= config.steps:
            break
        for group in optimizer.param_groups:
            group["lr"] = config.rate * schedule(step, config.steps, config.warm_up)
        x = inputs.to(config.device).contiguous(memory_format=torch.channels_last)
        with torch.autocast(config.device, torch.bfloat16):
            y = net(x)
        losses = loss_of(y.float(), label.to(config.device))
        optimizer.zero_grad()
        (losses[0] + 2 * losses[1]).backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 2.0)
        optimizer.step()
        average.update_parameters(net)
        sums += [float(v.detach()) for v in losses]
        if (step + 1) % 100 == 0:
            spent = (time.time() - began) / (step + 1 - start)
            print(
                f"step {step + 1}: object {sums[0] / 100:.4f}, same {sums[1] / 100:.4f}, {spent:.2f} s",
                flush=True,
            )
            sums[:] = 0
        if (step + 1) % config.save_every == 0 or step + 1 == config.steps:
            state = {"step": step + 1, "net": net.state_dict(), "optimizer": optimizer.state_dict()}
            torch.save({**state, "average": average.state_dict()}, out.with_suffix(".part"))
            out.with_suffix(".part").rename(out)


def _some(scenes: Path, config: SampleConfig) -> Tensor:
    """Inputs of a few squares."""
    squares = iter(Squares(scenes, 0, config))
    return torch.from_numpy(np.stack([next(squares)[0] for _ in range(_MEASURED)]))


def schedule(step: int, steps: int, warm_up: int) -> float:
    """Share of the highest learning rate at a step: up in a line, down in half a cosine."""
    if step < warm_up:
        return (step + 1) / warm_up
    done = (step - warm_up) / max(steps - warm_up, 1)
    return 0.5 * (1 + float(np.cos(np.pi * min(done, 1.0)))) * 0.99 + 0.01
