"""The commands: collect trials, train a score, try it out on fresh scenes, report; try what can be grasped at all."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from tools.running import exit_code
from torc.errors import InputError
from torc.grasping.geometric_planner import MODEL_PATH


@dataclass(frozen=True)
class Collect:
    """Try sampled grasps in simulated scenes and store features and outcomes. Goes on where it was interrupted."""

    out: Path
    """Directory of the shards; one per seed."""
    scenes: int = 1000
    """Scenes in all, those already there included."""
    seed: int = 0
    """Decides every scene and choice."""

    def run(self) -> None:
        """Collect."""
        from tools.grasp_model.collect import collect

        collect(self.out, self.scenes, self.seed)


@dataclass(frozen=True)
class Refresh:
    """Recompute the features of collected trials, after the features have changed. Goes on where interrupted."""

    data: Path
    """Directory of shards."""
    out: Path
    """Directory of the new shards."""

    def run(self) -> None:
        """Refresh."""
        from tools.grasp_model.refresh import refresh

        refresh(self.data, self.out)


@dataclass(frozen=True)
class Train:
    """Fit the score and write it as plain arrays."""

    data: tuple[Path, ...]
    """Directories of shards."""
    out: Path = MODEL_PATH
    """The model."""

    def run(self) -> None:
        """Train."""
        from tools.grasp_model.dataset import load_trials
        from tools.grasp_model.evaluation import auc, brier, log_loss
        from tools.grasp_model.export import export
        from tools.grasp_model.train import TrainConfig, fit

        trials = load_trials(self.data)
        print(
            f"{len(trials)} trials, {100 * trials.delivered.mean():.1f} % delivered. Fitting ...", flush=True
        )
        fitted = fit(trials, TrainConfig())
        for name, p in (("hand-written", trials.p_hand.astype(float)), ("learned", fitted.p)):
            loss, error = log_loss(p, trials.delivered), brier(p, trials.delivered)
            print(f"{name:13s} AUC {auc(p, trials.delivered):.4f}  log loss {loss:.4f}  Brier {error:.4f}")
        difference = export(fitted, trials, self.out)
        print(
            f"Wrote {self.out} ({self.out.stat().st_size / 1e6:.2f} MB); differs from sklearn by {difference:.1e}."
        )


@dataclass(frozen=True)
class Recalibrate:
    """Bring what the score promises in line with what whole trials delivered, with the arm, at first tries.

    Play them on problems of their own, never on those that planners are compared on: `torc problems generate`, `torc
    bench --planners random,dg-select`, `torc report`.
    """

    picks: tyro.conf.Positional[tuple[Path, ...]]
    """Tables of picks, as `torc report` writes them (picks.csv), of trials played with this model."""
    model: Path = MODEL_PATH
    """The model; it is rewritten."""
    rough: bool = False
    """The trials were played on depth with a sensor's errors (`--depth sgbm`): bring only that calibration in line."""

    def run(self) -> None:
        """Recalibrate."""
        from tools.grasp_model.evaluation import calibration_error, log_loss
        from tools.grasp_model.export import save_trees
        from tools.grasp_model.recalibration import fit_promise, read_tries, recalibrated
        from torc.grasping.features import FEATURE_NAMES
        from torc.grasping.trees import load_trees

        tries = read_tries(self.picks)
        promise = fit_promise(tries.p, tries.delivered)
        told = (
            f"log-odds {promise.shift:+.3f} + {promise.slope:.3f} x, {promise.slope_above:.3f} above .9, by "
            f"{len(tries)} first tries with the arm{' on rough depth' if self.rough else ''}"
        )
        for name, p in (("promised", tries.p), ("now", promise.kept(tries.p))):
            error, loss = calibration_error(p, tries.delivered), log_loss(p, tries.delivered)
            print(f"{name:9s} mean {p.mean():.3f}  calibration error {error:.4f}  log loss {loss:.4f}")
        print(f"delivered {tries.delivered.mean():.3f}. {told}")
        model = load_trees(self.model, FEATURE_NAMES)
        save_trees(self.model, recalibrated(model, promise, told, self.rough))


@dataclass(frozen=True)
class Evaluate:
    """Try the best grasp of every visible object by several rules, in fresh scenes. Goes on where interrupted."""

    out: Path
    """Directory of the shards; one per seed."""
    model: Path = MODEL_PATH
    """A trained score."""
    scenes: int = 60
    """Scenes in all; every third holds kinds of objects that were never trained on."""
    seed: int = 1000
    """Must differ from the seeds of the training data."""

    def run(self) -> None:
        """Evaluate."""
        from tools.grasp_model.collect import evaluate

        evaluate(self.out, self.scenes, self.seed, self.model)


@dataclass(frozen=True)
class Report:
    """Write the report: cross-validated quality, calibration, learning curve, and one try per object."""

    data: tuple[Path, ...]
    """Directories of training shards."""
    held_out: tuple[Path, ...] = ()
    """Directories that `evaluate` wrote."""
    model: Path = MODEL_PATH
    """The model trained with these data; its notes say how it was recalibrated."""
    out: Path = Path("results/grasp-model/README.md")
    """The text."""
    picture: Path = Path("results/grasp-model/calibration.png")
    """The calibration curve."""

    def run(self) -> None:
        """Report."""
        from tools.grasp_model.dataset import load_trials
        from tools.grasp_model.report import write_report
        from tools.grasp_model.train import TrainConfig
        from torc.grasping.features import FEATURE_NAMES
        from torc.grasping.trees import load_trees

        train = load_trials(self.data)
        held_out = load_trials(self.held_out) if self.held_out else None
        if held_out is not None and set(train.seed.tolist()) & set(held_out.seed.tolist()):
            raise InputError(
                "The held-out scenes share a seed with the training data. Evaluate with another --seed."
            )
        notes = load_trees(self.model, FEATURE_NAMES).notes
        write_report(train, held_out, self.out, self.picture, TrainConfig(), notes)
        print(f"Wrote {self.out} and {self.picture}.")


@dataclass(frozen=True)
class Graspable:
    """Try which library models the gripper gets hold of, and store it. Models already tried are kept."""

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Models to try; all if none are named."""
    again: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Try models again that have not changed since."""

    def run(self) -> None:
        """Measure."""
        from tools.grasp_model.feasibility import measure_all

        measure_all(self.names, self.again)


def main(arguments: list[str] | None = None) -> int:
    """Run one command; 0 when done, 1 on failure, 2 on bad input."""
    command = tyro.cli(
        Collect | Refresh | Train | Recalibrate | Evaluate | Report | Graspable,
        args=arguments,
        prog="python -m tools.grasp_model",
    )
    return exit_code(command)
