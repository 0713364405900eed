"""The learned picker: what comes of each choice, and the weights that tell the best one.

    python -m tools.learned_picker collect runs/fresh --out build/picker
    python -m tools.learned_picker train build/picker --out build/picker.npz
    python -m tools.learned_picker collect runs/fresh --out build/picker2 --planner learned   # its own looks
    python -m tools.learned_picker train build/picker build/picker2

At each look of a retrieval, every object that can be picked is taken in turn, and a planner goes on from there; the
picks to the target are the choice's value. Nothing slips or falls (`tools.ideal`), so that a value is of the
choice and not of luck. The model is trained to tell the choices that no other one beats.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from jaxtyping import Float, Float32, Int64

from tools.ideal import Look, Retrieval, after, looks_of, retrieve
from tools.running import exit_code
from torc.episode.privileged import open_sandbox
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, PhysicsError
from torc.io.record_files import load_record, save_record
from torc.oracle.solve import MAX_PICKS
from torc.pipeline.building import build_system
from torc.pipeline.planners import is_reference, make_planner
from torc.problems.problem import load_problem
from torc.problems.sets import select_problems
from torc.records import TARGET_ID
from torc.specs.conditions import Conditions
from torc.task_planning.learned.features import FEATURE_NAMES, features_of
from torc.task_planning.learned.learned_planner import MODEL_PATH, PickerModel
from torc.task_planning.protocol import TaskPlanner


@dataclass(frozen=True)
class Choices:
    """All choices at the looks of one retrieval.

    Attributes:
        features: as `features_of` makes them.
        picks: until the target is taken, this one included, if the choice is made and the planner goes on.
        look: number of the look to which each row belongs.
        planners: whether the planner that went on would choose it.
    """

    features: Float32[np.ndarray, "n f"]
    picks: Float[np.ndarray, "n"]
    look: Int64[np.ndarray, "n"]
    planners: Int64[np.ndarray, "n"]


@dataclass(frozen=True)
class Collect:
    """Try every choice at every look of a planner's own retrievals. Goes on where it was interrupted."""

    problems: tyro.conf.Positional[str]
    """Sets, problems, problem files or directories of them, comma-separated; none that planners are compared on."""
    out: Path
    """Directory of the choices, one file per problem."""
    planner: str = "dg-select"
    """Who chooses the looks, and goes on after each choice."""
    most_looks: int = 6
    """Looks of each retrieval, at most."""

    def run(self) -> None:
        """Collect. Raises InputError for a planner that needs the simulation."""
        if is_reference(self.planner):
            raise InputError(f"{self.planner} tries picks out in a simulation of its own; here are none.")
        planner, system = make_planner(self.planner), build_system(Conditions())
        self.out.mkdir(parents=True, exist_ok=True)
        files = select_problems(self.problems)
        for number, file in enumerate(files, 1):
            path = self.out / f"{Path(file).stem}.npz"
            if path.exists():
                continue
            try:
                with open_sandbox(load_problem(file), system, EpisodeConfig(MAX_PICKS, 0)) as sandbox:
                    found = choices_of(planner, looks_of(sandbox), self.most_looks)
            except PhysicsError as error:
                print(f"[{number}/{len(files)}] {path.stem}: {error}", flush=True)
                continue
            save_record(found, path)
            told = f"{found.look.max(initial=-1) + 1} looks, {len(found.picks)} choices"
            print(f"[{number}/{len(files)}] {path.stem}: {told}", flush=True)


def choices_of(planner: TaskPlanner, look: Look, most_looks: int) -> Choices:
    """All choices along the planner's own retrieval, each followed to its end. Raises PhysicsError."""
    rows: list[tuple[Any, ...]] = []
    found = Retrieval()
    for number in range(most_looks):
        context = look(found.order)
        ids, features = features_of(context, np.random.default_rng(0))
        own = planner.decide(context, np.random.default_rng(0)).object_id
        if own not in ids:
            break
        for k, row in zip(ids, features):
            end = retrieve(planner, look, Retrieval((*found.order, k), taken=k == TARGET_ID))
            rows.append((row, end.picks - len(found.order), number, int(k == own)))
        found = after(found, context, own)
        if found.taken:
            break
    return Choices(
        np.array([r[0] for r in rows], np.float32).reshape(len(rows), len(FEATURE_NAMES)),
        np.array([r[1] for r in rows], float),
        np.array([r[2] for r in rows], np.int64),
        np.array([r[3] for r in rows], np.int64),
    )


@dataclass(frozen=True)
class Train:
    """Fit the weights, and tell what their choices are worth on problems that they were not fitted to."""

    choices: tyro.conf.Positional[tuple[Path, ...]]
    """Directories that `collect` made."""
    out: Path = MODEL_PATH
    """The model."""
    folds: int = 8
    """Parts of the problems, each left out once."""

    def run(self) -> None:
        """Train. Raises InputError where there is nothing to train on."""
        collected = load_choices(self.choices)
        names = sorted(collected)
        if len(names) < self.folds:
            raise InputError(
                f"There are choices of {len(names)} problems; training needs {self.folds} at least."
            )
        gains = []
        for part in range(self.folds):
            left_out = names[part :: self.folds]
            model = fit(c for n in names if n not in left_out for c in collected[n])
            gains += [g for n in left_out for c in collected[n] for g in gains_of(model, c)]
        rows = np.array(gains)
        for hidden, where in ((True, "out of sight"), (False, "in sight")):
            own = rows[rows[:, 0] == hidden, 1:]
            if len(own):
                learned, best, random = own.mean(axis=0)
                error = own[:, 0].std() / np.sqrt(len(own))
                print(
                    f"{len(own)} looks with the target {where}: {learned:+.3f} +- {error:.3f} picks against the "
                    f"planner that goes on (the best choice {best:+.2f}, a random one {random:+.2f})"
                )
        looks = f"{len(names)} problems, {len(rows)} looks"
        save_record(fit((c for n in names for c in collected[n]), looks), self.out)
        print(f"Wrote {self.out}.")


def load_choices(directories: Iterable[Path]) -> dict[str, list[Choices]]:
    """What was collected, by problem. Raises InputError for a directory without choices."""
    found: dict[str, list[Choices]] = {}
    for directory in directories:
        files = sorted(directory.glob("*.npz"))
        if not files:
            raise InputError(
                f"{directory} has no choices; `python -m tools.learned_picker collect` makes them."
            )
        for file in files:
            found.setdefault(file.stem, []).append(load_record(file, Choices))
    return found


def fit(collected: Iterable[Choices], notes: str = "") -> PickerModel:
    """The weights by which no other choice of the same look is better."""
    from sklearn.linear_model import LogisticRegression

    collected = list(collected)
    features = np.concatenate([c.features for c in collected]).astype(float)
    best = np.concatenate([c.picks <= _per_look(c, np.min) for c in collected])
    mean = np.nan_to_num(np.nanmean(features, axis=0))
    scale = np.nan_to_num(np.nanstd(features, axis=0))
    scale = np.where(scale > 1e-9, scale, 1.0)
    standard = np.nan_to_num((features - mean) / scale)
    model = LogisticRegression(C=1.0, max_iter=5000).fit(standard, best)
    return PickerModel(
        FEATURE_NAMES, mean, scale, model.coef_[0].astype(float), float(model.intercept_[0]), notes
    )


def gains_of(model: PickerModel, c: Choices) -> list[tuple[float, float, float, float]]:
    """Per look: whether the target is out of sight, and the picks of the model's choice, the best and a random one,
    each against those of the planner that goes on.
    """
    out, p = [], model.score(c.features)
    for look in np.unique(c.look):
        of = np.flatnonzero(c.look == look)
        own = c.picks[of][c.planners[of] == 1][0]
        hidden = c.features[of[0], FEATURE_NAMES.index("target in sight")] == 0
        chosen = c.picks[of[int(np.argmax(p[of]))]]
        out.append((float(hidden), chosen - own, c.picks[of].min() - own, c.picks[of].mean() - own))
    return out


def _per_look(c: Choices, reduce: Any) -> Float[np.ndarray, "n"]:
    """A number of each look's picks, for each of its rows."""
    return np.array([reduce(c.picks[c.look == look]) for look in c.look], dtype=float)


Commands = (
    Annotated[Collect, tyro.conf.subcommand("collect", description=Collect.__doc__)]
    | Annotated[Train, tyro.conf.subcommand("train", description=Train.__doc__)]
)

if __name__ == "__main__":
    raise SystemExit(exit_code(tyro.cli(Commands, description=__doc__)))
