"""The three verbs of the Python interface: step through an episode, play a trial, compare planners.

Everything runs in the simulator and writes no files, except to a given `out`.
"""

import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import fields
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Self

import torc
from torc.benchmark.local_pool import LocalPool, PoolConfig, ThisProcess
from torc.benchmark.playing import Order, run_missing, shown
from torc.benchmark.reading import read_table
from torc.benchmark.rows import Table
from torc.benchmark.spec import BenchPlanner, find_around, find_planner, find_problems, make_spec
from torc.benchmark.store import TRIAL, Store
from torc.episode.events import Decided, Ended, Started
from torc.episode.simulated import episode_in, simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError, UnknownNameError
from torc.io.digests import part_source
from torc.pipeline.building import build_system
from torc.pipeline.look import Look
from torc.pipeline.planners import as_planner
from torc.pipeline.state import EndReason
from torc.pipeline.warm_up import announced_compilation
from torc.problems.problem import load_problem
from torc.records import Decision, PickOutcome, PlanningContext
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.task_planning.protocol import TaskPlanner
from torc.trials.log import EndedLine, EventLine
from torc.trials.recorder import TrialLog
from torc.trials.trial import Recording, Trial, run_trial
from torc.vlm.config import VlmConfig, parse_vlm

Planner = str | TaskPlanner | Callable[[], TaskPlanner]
"""A planner's name ("dg-select", "module:Class", "file.py:Class"), a planner, or a factory, e.g. its class."""


def _to_stderr(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class Episode:
    """A retrieval in the simulator, one pick after another, without any files.

    Use it in a `with`, or `close` it. The same problem, seed, conditions and picks give the same episode.

    Example:
        with torc.Episode("structured-03", seed=0) as episode:
            while not episode.done:
                context = episode.look()
                best = max(context.graspable_ids, key=context.p, default=None)
                print(episode.pick(best).result)
    """

    def __init__(
        self,
        problem: str | PathLike[str],
        *,
        seed: int = 0,
        say: Callable[[str], None] = _to_stderr,
        **conditions: Any,
    ) -> None:
        """Build the world and let it come to rest.

        Args:
            problem: name of a shipped problem (`torc.problem_names()`), or path of a problem file.
            seed: decides all random draws: grasps, motions, and noise if enabled.
            say: called with a line of text before something that takes long (default: standard error).
            conditions: fields of `torc.Conditions`, e.g. max_picks=10, perception="embedded", noise=True.

        Raises:
            InputError: the problem or a condition cannot be used.
            PhysicsError: the simulation broke.
        """
        loaded = load_problem(problem)
        around = _conditions(conditions).at(loaded.workspace)
        system, config = build_system(around), EpisodeConfig(around.max_picks, seed)
        self._stack, self._log = ExitStack(), TrialLog()
        self._seen: Look | None = None
        with ExitStack() as opening:
            simulated = opening.enter_context(simulated_robot(system, loaded))
            absent = simulated.take_over()
            self._episode = episode_in(simulated, system, config, [self._log])
            with announced_compilation(say):
                self._episode.rehearse()
            self._stack = opening.pop_all()
        names = tuple(placement.name for placement in loaded.ordered())
        self._episode.steps.tell(
            Started(loaded.name, "you", seed, loaded.description, around.max_picks, names, absent)
        )

    def look(self) -> PlanningContext | None:
        """Return the context that a task planner would receive before the next pick; None once the episode is over.

        It is unchanged between two picks. `context.scene.observation.rgb` is the picture, `context.graspable_ids` are
        the objects that can be picked, and `context.p` says how probably their best grasps succeed.

        Raises:
            TorcError: a part failed.
        """
        if self._seen is None:
            self._seen = self._episode.look()
            if self._seen is None and not isinstance(self.log[-1], EndedLine):
                self._episode.steps.tell(Ended(self._episode.result()))
        return None if self._seen is None else self._seen.context

    @property
    def done(self) -> bool:
        """True once there is nothing more to pick: retrieved, lost, given up, or the budget is spent. Looks."""
        return self.look() is None

    @property
    def end(self) -> EndReason | None:
        """Why the episode ended; None while it goes on."""
        return self._episode.end

    @property
    def retrieved(self) -> bool:
        """True once the target was delivered to the bin."""
        return self.end is EndReason.RETRIEVED

    @property
    def outcomes(self) -> tuple[PickOutcome, ...]:
        """The outcomes of the picks so far."""
        return self._episode.state.outcomes

    @property
    def log(self) -> tuple[EventLine, ...]:
        """Everything that happened so far: the lines of a trial's `events.jsonl`."""
        return tuple(self._log.lines)

    def pick(self, object_id: int | None, reason: str = "") -> PickOutcome:
        """Pick an object, by its id in `look`, and return the outcome.

        An object that is not in sight or has no valid grasp, and None, are lost picks: they count. The outcome is the
        simulator's truth; `outcome.as_felt` is what a robot would know.

        Raises:
            InputError: the episode is over.
            PhysicsError: the simulation broke.
        """
        decision = Decision(None if object_id is None else int(object_id), reason)
        self._carry_out(decision)
        return self.outcomes[-1]

    def give_up(self, reason: str = "") -> None:
        """End the episode without the target. Raises InputError if it is over."""
        self._carry_out(Decision(None, reason, give_up=True))

    def close(self) -> None:
        """Free the world and its camera."""
        self._stack.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _carry_out(self, decision: Decision) -> None:
        self.look()
        if self._seen is None:
            raise InputError(f"The episode is over: {self.end}. Make another one.")
        look, self._seen = self._seen, None
        self._episode.steps.tell(Decided(self._episode.state.pick, look, decision, 0.0))
        self._episode.pick(look, decision)


def play(
    problem: str | PathLike[str],
    planner: Planner = "dg-select",
    *,
    seed: int = 0,
    out: str | PathLike[str] | None = None,
    vlm: str | VlmConfig | None = None,
    video: bool = False,
    overwrite: bool = False,
    say: Callable[[str], None] = _to_stderr,
    **conditions: Any,
) -> Trial:
    """Play one trial: a task planner retrieves the target of a problem in the simulator.

    Args:
        problem: name of a shipped problem (`torc.problem_names()`), or path of a problem file.
        planner: a planner's name, a planner, or its class.
        seed: decides all random draws.
        out: directory for log, pictures and result, as `torc run` writes it; None keeps the log in memory.
        vlm: the model that the planner asks, as on the command line ("gemini:MODEL", "simulated").
        video: also write video.mp4 to `out`.
        overwrite: replace a trial that is in `out`.
        say: called with a line of text before something that takes long (default: standard error).
        conditions: fields of `torc.Conditions`, e.g. max_picks=10, perception="embedded", noise=True.

    Returns:
        The trial: `trial.result` (retrieved, picks, drops, end, ...) and `trial.log`, one line per event. If a part
        crashed, `trial.result.status` is "errored" and `trial.result.error` says why.

    Raises:
        InputError: something cannot be used; nothing was played.
    """
    spec, made = _planner(planner, vlm)
    return run_trial(
        TrialSpec(str(problem), spec, seed, _conditions(conditions)),
        None if out is None else Path(out),
        planner=None if made is None else made(),
        recording=Recording(video=video),
        overwrite=overwrite,
        say=say,
    )


def bench(
    problems: str | Sequence[str],
    planners: Sequence[Planner] = ("random", "dg-select"),
    *,
    repeats: int = 1,
    workers: int = 1,
    out: str | PathLike[str] | None = None,
    vlm: str | VlmConfig | None = None,
    **conditions: Any,
) -> Table:
    """Play every planner on every problem, under equal conditions.

    Args:
        problems: sets ("validation", "torc40"), names, files or directories of problems: a sequence, or one text with
            commas between.
        planners: names, planners, or classes; a class is made anew for every trial.
        repeats: seeds 0, 1, ... for each planner and problem.
        workers: processes. With 1 everything runs in this process. Other processes import planners by name, so that
            with more than one a class has to be in a module or file, not in a notebook.
        out: directory for all trials, as `torc bench` writes it: a repeated call continues it. None keeps only the
            table.
        vlm: the model that planners ask, if they ask any.
        conditions: fields of `torc.Conditions`.

    Returns:
        The table: `table.rows`, one per trial. `pandas.DataFrame(table.rows)` makes a data frame of it.

    Raises:
        InputError: something cannot be used; nothing was played.
    """
    if repeats < 1 or workers < 1:
        raise InputError("repeats and workers must be at least 1.")
    found = find_problems(problems if isinstance(problems, str) else ",".join(problems))
    around = find_around(_conditions(conditions))
    makers: dict[str, Callable[[], TaskPlanner]] = {}
    chosen = []
    for planner in planners:
        spec, made = _planner(_importable(planner) if workers > 1 else planner, vlm)
        if made is None:
            chosen.append(find_planner(spec, None, own_vlm=False))
        else:
            makers[spec.name] = made
            chosen.append(BenchPlanner(spec, part_source(type(made()))))
    whole = make_spec(tuple(found), chosen, range(repeats), around, torc.__version__)

    def play_here(order: Order) -> None:
        made = makers.get(order.trial.planner.spec.name)
        planner = None if made is None else made()
        spec, place = order.trial.spec(order.problem), order.work / TRIAL
        run_trial(spec, place, planner=planner, overwrite=True, say=_to_stderr)

    with nullcontext(out) if out is not None else TemporaryDirectory(prefix="torc-bench-") as root:
        store = Store(Path(root))
        store.check()
        with store.locked(), shown(len(store.left(whole))) as show:
            store.extend(whole, {problem.name: problem for problem in found.values()})
            backend = ThisProcess() if workers == 1 else LocalPool(PoolConfig(workers))
            run_missing(store, whole, backend, listener=show, work=play_here if workers == 1 else None)
        return read_table(store.root)


def _conditions(given: dict[str, Any]) -> Conditions:
    names = [f.name for f in fields(Conditions)]
    if unknown := [name for name in given if name not in names]:
        raise UnknownNameError("condition", unknown[0], names)
    return Conditions(**given)


def _planner(
    planner: Planner, vlm: str | VlmConfig | None
) -> tuple[PlannerSpec, Callable[[], TaskPlanner] | None]:
    """Return a planner's spec for the record, and a factory if a name does not suffice to make it."""
    config = VlmConfig(*parse_vlm(vlm)) if isinstance(vlm, str) else vlm
    if isinstance(planner, str):
        return PlannerSpec(planner, config), None
    made = as_planner(planner)
    return PlannerSpec(made.name), (lambda: made) if made is planner else planner  # type: ignore[return-value]


def _importable(planner: Planner) -> str:
    """Return the name by which another process finds a planner."""
    if isinstance(planner, str):
        return planner
    name, module = getattr(planner, "__qualname__", "<"), getattr(planner, "__module__", None)
    if module == "__main__":
        module = getattr(sys.modules[module], "__file__", None)  # None in a notebook
    if not isinstance(planner, type) or module is None or "<" in name:
        raise InputError(
            f"With several workers a planner must be a name, or a class in a module or file, not {planner!r}. Write it "
            "to a file, or use workers=1."
        )
    return f"{module}:{name}"
