"""The commands: collect views, train the two networks, export them, measure them."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from tools.running import exit_code
from torc.objects.library import ENVIRONMENT_VARIABLE


@dataclass(frozen=True)
class Collect:
    """Make settled scenes and look at each from many sides. Goes on where it was interrupted."""

    out: Path
    """Directory of the scenes."""
    scenes: int = 800
    """Scenes in all, those already there included."""
    seed: int = 11
    """Decides every scene and view; another one for scenes to measure on."""
    objects: Literal["known", "held-out", "own"] = "known"
    """known: kinds to train on, each also stretched, and made-up objects; held-out: kinds that are never trained on;
    own: what TORC_OBJECTS names, e.g. imported meshes."""
    variants: Path = Path("build/eyes-objects")
    """Where the stretched and the made-up objects are kept."""
    made_up: int = 400
    """How many made-up objects there are beside the known ones and their stretched copies."""
    part: tuple[int, int] = (0, 1)
    """Which of how many parts of the scenes: for several processes at once. The first time, let the first process reach
    its first scene before you start the others: it makes the objects."""

    def run(self) -> None:
        """Collect."""
        from tools.eyes.collect import CollectConfig, collect_scene
        from tools.eyes.made_up import make_up
        from tools.eyes.variants import make_variants
        from torc.objects.library import builtin_object_names, object_facts, stored_objects
        from torc.workspace.workspace_files import load_workspace

        built_in = builtin_object_names()
        if self.objects == "own":
            names: Sequence[str] = list(stored_objects())
        elif self.objects == "held-out":
            names = [n for n in built_in if object_facts(n).held_out]
        else:
            os.environ[ENVIRONMENT_VARIABLE] = str(self.variants)
            names = [
                *make_variants(self.variants, 2, 1),
                *make_up(self.variants, self.made_up, 1),
                *(n for n in built_in if not object_facts(n).held_out),
            ]
        self.out.mkdir(parents=True, exist_ok=True)
        for number in range(self.part[0], self.scenes, self.part[1]):
            views = collect_scene(self.out, number, self.seed, names, load_workspace(), CollectConfig())
            print(f"scene {number + 1}/{self.scenes}: {views} views", file=sys.stderr)


@dataclass(frozen=True)
class Train:
    """Train the segmentation network. Goes on where it was interrupted."""

    scenes: Path
    """Directory of scenes."""
    weights: Path
    """The weights, written ever again."""
    steps: int = 16_000
    """Steps in all."""
    rate: float = 1.5e-3
    """Highest learning rate; a third of it to go on from the shipped network."""
    shipped: bool = False
    """Begin with the network that torc ships, instead of with nothing."""
    workers: int = 1
    """Processes that prepare samples."""
    device: str = "cpu"
    """cpu, or cuda where there is one."""

    def run(self) -> None:
        """Train."""
        from tools.eyes.train import TrainConfig, train

        config = TrainConfig(
            steps=self.steps,
            rate=self.rate,
            shipped=self.shipped,
            workers=self.workers,
            device=self.device,
        )
        train(self.scenes, self.weights, config)


@dataclass(frozen=True)
class Describe:
    """Train the descriptor, by which targets are known and ids kept. Goes on where it was interrupted."""

    scenes: Path
    """Directory of scenes."""
    weights: Path
    """The weights."""
    crops: Path = Path("build/eyes-crops")
    """Where the objects' crops are kept."""
    steps: int = 8000
    """Steps in all."""
    rate: float = 2e-3
    """Highest learning rate; a third of it to go on from the shipped descriptor."""
    alike: float = 0.1
    """Share of the objects of a batch that take the colour of others: only shape and pattern tell those apart."""
    shipped: bool = False
    """Begin with the descriptor that torc ships, instead of with nothing."""

    def run(self) -> None:
        """Train."""
        from tools.eyes.descriptor import DescriptorConfig, save_crops, train_descriptor

        config = DescriptorConfig(steps=self.steps, rate=self.rate, alike=self.alike, shipped=self.shipped)
        train_descriptor(save_crops(self.scenes, self.crops), self.weights, config)


@dataclass(frozen=True)
class Export:
    """Write the networks as ONNX, as torc ships them."""

    eyes: Path | None = None
    """Weights of the segmentation network."""
    descriptor: Path | None = None
    """Weights of the descriptor."""

    def run(self) -> None:
        """Export."""
        from tools.eyes.export import export_descriptor, export_eyes
        from torc.perception.embedded.model import DESCRIPTOR, EYES

        if self.eyes is not None:
            export_eyes(self.eyes, EYES)
        if self.descriptor is not None:
            export_descriptor(self.descriptor, DESCRIPTOR)


@dataclass(frozen=True)
class Measure:
    """Measure the masks of the shipped network on views."""

    scenes: tyro.conf.Positional[tuple[Path, ...]]
    """Directories of scenes that were not trained on."""
    every: int = 1
    """Every so manieth view."""
    worst: Path | None = None
    """A picture of the worst views."""

    def run(self) -> None:
        """Measure."""
        from tools.eyes.measure import measure

        for directory in self.scenes:
            measure(directory, self.every, self.worst)


@dataclass(frozen=True)
class Target:
    """Fit how surely a mask is the target, by its likeness to reference pictures, and measure it."""

    problems: int = 60
    """Scenes of as many seeds."""
    held_out: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Of kinds that are never trained on."""

    def run(self) -> None:
        """Fit."""
        from tools.eyes.fit_target import fit_target

        fit_target(self.problems, self.held_out)


@dataclass(frozen=True)
class Held:
    """Fit how surely what is in the hand is the target, and measure it."""

    problems: int = 40
    """Scenes of as many seeds, up to eight picks in each."""
    depth: str = "sgbm"
    """Depth: sgbm or as-measured."""
    held_out: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Of kinds that are never trained on."""

    def run(self) -> None:
        """Fit."""
        from tools.eyes.fit_held import fit_held

        fit_held(self.problems, self.depth, self.held_out)


@dataclass(frozen=True)
class LossesCommand:
    """What perception cost in trials of `torc bench --perception embedded`: ids, target, masks, failed picks."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Directories of benchmarks, played together in one table."""

    def run(self) -> None:
        """Print."""
        from tools.eyes.losses import print_losses

        print_losses(self.runs)


Losses = Annotated[LossesCommand, tyro.conf.subcommand("losses")]


def main(arguments: list[str] | None = None) -> int:
    """Run one command; 0 when done, 1 on failure, 2 on bad input."""
    command = tyro.cli(
        Collect | Train | Describe | Export | Measure | Target | Held | Losses,
        args=arguments,
        prog="python -m tools.eyes",
    )
    return exit_code(command)
