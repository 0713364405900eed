"""Each stage of a pick: its wall and processor time, against its budget, the paper's system, or another checkout.

    python -m benchmarks.stages                              # every stage against its budget and the paper
    python -m benchmarks.stages --objects 5 10 20 32 45 63   # a look at so many objects
    python -m benchmarks.stages --against ../before          # this checkout beside another one, in turn
    python -m benchmarks.stages --every 4 --perception embedded --depth sgbm

Plays the first picks of problems of torc40 with DG-SELECT, kernels warm, in one process, on all cores that it may use.
The paper's times are its authors': grasp planning 16-20 s, motion planning 4-5 s, DG-SELECT 27 s (5 s in a later
rerun), an episode 380-630 s, all on a GPU workstation. With --against, both checkouts are measured by this file, in a
process each, one after the other: only what both have can be compared.
"""

import json
import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from cProfile import Profile
from dataclasses import dataclass, field
from pathlib import Path
from pstats import Stats
from unittest.mock import patch

import numpy as np
import tyro
from numba.core.dispatcher import Dispatcher

from torc.episode.events import Decided, Event, Executed, Looked, Planned, Started
from torc.episode.loop import run_episode
from torc.episode.simulated import episode_in, simulated_robot
from torc.episode.steps import EpisodeConfig
from torc.pipeline.building import System, build_system
from torc.pipeline.planners import make_planner
from torc.pipeline.state import stage_rng
from torc.problems.problem import load_problem
from torc.problems.sets import problem_names
from torc.specs.conditions import Conditions
from torc.task_planning.protocol import ask_planner
from torc.testing.synthetic import random_clutter, synthetic_capture


@dataclass(frozen=True)
class Row:
    """A line of the table: the budget's median and 95th percentile, and the paper's time; seconds."""

    median_s: float
    p95_s: float
    paper_s: float = float("nan")


BUDGETS = {
    "perceive + occlusion update": Row(0.060, 0.100),
    "grasps, IK, validity, blocking": Row(0.300, 0.600, 18.0),
    "DG-SELECT decision": Row(0.010, 0.050, 27.3),
    "image to decision": Row(0.500, float("nan"), 45.0),
    "motion plans of one pick": Row(0.150, 0.500, 4.5),
    "simulated pick": Row(1.5, 4.0),
}
OWN_EYES = BUDGETS | {
    "perceive + occlusion update": Row(0.150, float("nan")),
    "image to decision": Row(0.600, float("nan"), 45.0),
}
"""For perceptions that find the objects themselves."""
_SCENES = 3
"""Made-up scenes per number of objects."""
_REPEATS = 3
"""Looks at each; the fastest counts."""


@dataclass(frozen=True)
class Args:
    """Time the stages."""

    seeds: int = 1
    """Seeds per problem."""
    picks: int = 3
    """Picks per episode."""
    every: int = 1
    """Every so manieth problem."""
    objects: tuple[int, ...] = ()
    """Time looks at made-up scenes of so many objects instead of episodes."""
    against: Path | None = None
    """Another checkout to measure in turn with this one."""
    pairs: int = 3
    """How often each checkout is measured."""
    json: bool = False
    """Print one line of JSON: seconds of every sample, by clock and step."""
    conditions: tyro.conf.OmitArgPrefixes[Conditions] = field(default_factory=Conditions)


Samples = Mapping[str, Mapping[str, Sequence[float]]]
"""Seconds, by clock ("wall", "processor") and step; with "kernels", calls and seconds of compiled functions a look."""


class Stopwatch:
    """Collects the seconds of each stage from the events."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    def __call__(self, event: Event) -> None:
        """Note one event's times."""
        match event:
            case Looked():
                s = event.look.seconds
                self.seconds["perceive + occlusion update"].append(s["perceive"] + s["occlusion"])
                grasps = s["collision world"] + s["grasps"] + s["validity"]
                self.seconds["grasps, IK, validity, blocking"].append(grasps)
                self._look_s = sum(s.values())
            case Decided():
                self.seconds["DG-SELECT decision"].append(event.seconds)
                self.seconds["image to decision"].append(self._look_s + event.seconds)
            case Planned():
                self.seconds["motion plans of one pick"].append(event.seconds)
            case Executed() if event.seconds > 0:
                self.seconds["simulated pick"].append(event.seconds)
            case _:
                pass


def played(args: Args, system: System, every: int) -> Mapping[str, Sequence[float]]:
    """Play the episodes; the seconds of each step."""
    planner, watch = make_planner("dg-select"), Stopwatch()
    for seed in range(args.seeds):
        for problem in map(load_problem, problem_names("torc40")[::every]):
            with simulated_robot(system, problem) as simulated:
                simulated.take_over()
                episode = episode_in(simulated, system, EpisodeConfig(args.picks, seed), [watch])
                started = Started(problem.name, planner.name, seed, problem.description, args.picks)
                run_episode(episode, planner, started)
    return watch.seconds


def looks(args: Args, system: System) -> Mapping[str, Sequence[float]]:
    """Look at made-up scenes of some numbers of objects: the seconds of each stage, by number and stage."""
    planner, out = make_planner("dg-select"), defaultdict(list)
    for count in args.objects:
        for seed in range(_SCENES):
            shapes = random_clutter(np.random.default_rng(seed), count)
            capture = synthetic_capture(shapes, system.workspace.camera)
            trials = []
            for _ in range(_REPEATS):
                look = system.pipeline.look(capture, seed=1)
                start = time.perf_counter()
                ask_planner(planner, look.context, stage_rng(1, 0, "decide"))
                trials.append(look.seconds | {"decision": time.perf_counter() - start})
            best = min(trials, key=lambda seconds: sum(seconds.values()))
            for stage, seconds in (best | {"image to decision": sum(best.values())}).items():
                out[f"{count}|{stage}"].append(seconds)
            out[f"{count}|in sight"].append(float(len(look.context.scene.ids)))
    return out


def measured(args: Args) -> Samples:
    """Measure this checkout by both clocks, and count its kernels' calls."""
    system = build_system(args.conditions)

    def run(every: int) -> Mapping[str, Sequence[float]]:
        return looks(args, system) if args.objects else played(args, system, every)

    run(len(problem_names("torc40")))  # Loads the kernels.
    wall = run(args.every)
    with patch("time.perf_counter", time.process_time):
        processor = run(args.every)
    return {"wall": wall, "processor": processor, "kernels": kernels(), "memory": one_pass()}


def one_pass() -> Mapping[str, Sequence[float]]:
    """Copy the arrays of a look once: picture, volume and collision world. No look can be faster than that."""
    system, shapes = build_system(Conditions()), random_clutter(np.random.default_rng(0), 8)
    look = system.pipeline.look(synthetic_capture(shapes, system.workspace.camera))
    holders = look.captures[0].observation, look.context.scene, look.context.volume, look.world
    arrays = [v for holder in holders for v in vars(holder).values() if isinstance(v, np.ndarray)]
    seconds = []
    for _ in range(20):
        start = time.perf_counter()
        for array in arrays:
            array.copy()
        seconds.append(time.perf_counter() - start)
    return {"seconds": [min(seconds)], "MB": [sum(array.nbytes for array in arrays) / 1e6]}


def kernels() -> Mapping[str, Sequence[float]]:
    """Profile looks at ten made-up objects, with exact masks and decisions, in one thread.

    Returns each kernel's calls and seconds a look.
    """
    args, system = Args(objects=(10,)), build_system(Conditions())
    with patch.dict(os.environ, OMP_NUM_THREADS="1"):
        looks(args, system)
        profile = Profile()
        profile.enable()
        looks(args, system)
        profile.disable()
    names, found, count = dict(_kernels()), {}, _SCENES * _REPEATS
    for (file, line, _), (_, calls, seconds, *_rest) in Stats(profile).stats.items():  # type: ignore[attr-defined]
        if (file, line) in names:
            found[names[file, line]] = [calls / count, seconds / count]
    return found


def _kernels() -> Iterator[tuple[tuple[str, int], str]]:
    for name, module in list(sys.modules.items()):
        if name.startswith("torc."):
            for value in vars(module).values():
                if isinstance(value, Dispatcher):
                    code = value.py_func.__code__
                    where = value.py_func.__module__.removeprefix("torc.")
                    yield (code.co_filename, code.co_firstlineno), f"{where}.{code.co_name}"


def in_turn(args: Args, other: Path) -> list[tuple[Samples, Samples]]:
    """Measure this checkout and another one, in turn."""
    here = Path(__file__).resolve().parents[1]
    return [(_measured_in(here), _measured_in(other.resolve())) for _ in range(args.pairs)]


def _measured_in(checkout: Path) -> Samples:
    if not (checkout / "src" / "torc").is_dir():
        raise SystemExit(f"{checkout} is no checkout of torc: it has no src/torc.")
    env = os.environ | {"PYTHONPATH": f"{checkout / 'src'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    command = [sys.executable, __file__, *sys.argv[1:], "--json"]
    out = subprocess.run(command, env=env, stdout=subprocess.PIPE, text=True, check=True, cwd=checkout)
    found: Samples = json.loads(out.stdout.splitlines()[-1])
    return found


def main(args: Args) -> None:
    """Run and print."""
    if args.json:
        print(json.dumps(measured(args)))
    elif args.against is not None:
        print("\n".join(compared(in_turn(args, args.against))))
    elif args.objects:
        print("\n".join(curve(measured(args))))
    else:
        print("\n".join(against_budgets(measured(args), args.conditions)))


def compared(pairs: list[tuple[Samples, Samples]]) -> Iterator[str]:
    """Yield a table: medians of both checkouts, and the ratio, its median and range over the pairs."""
    yield "| step | clock | here, ms | there, ms | here / there | over the pairs |"
    yield "|---|---|---|---|---|---|"
    for step in pairs[0][0]["wall"]:
        if step.endswith("|in sight"):
            continue
        for clock in ("wall", "processor"):
            both = np.array([[np.median(run[clock][step]) for run in pair] for pair in pairs])
            here, there = 1e3 * np.median(both, axis=0)
            ratios = both[:, 0] / both[:, 1]
            within = f"{ratios.min():.2f} to {ratios.max():.2f}"
            name = step.replace("|", " objects: ")
            yield f"| {name} | {clock} | {here:.1f} | {there:.1f} | {np.median(ratios):.2f} | {within} |"
    calls = [sum(n for n, _ in run["kernels"].values()) for run in pairs[0]]
    yield f"| calls of kernels, a look | - | {calls[0]:.0f} | {calls[1]:.0f} | {calls[0] / calls[1]:.2f} | - |"


def curve(samples: Samples) -> Iterator[str]:
    """Yield a table: milliseconds of each stage by the number of objects."""
    wall, processor = samples["wall"], samples["processor"]
    counts = list(dict.fromkeys(key.split("|")[0] for key in wall))
    stages = list(dict.fromkeys(key.split("|")[1] for key in wall))
    stages.remove("in sight")
    yield f"| objects | in sight | {' | '.join(f'{stage}, ms' for stage in stages)} | processor, ms | ms an object |"
    yield "|" + "---|" * (len(stages) + 4)
    for count in counts:
        ms = [1e3 * float(np.mean(wall[f"{count}|{stage}"])) for stage in stages]
        seen = float(np.mean(wall[f"{count}|in sight"]))
        spent = 1e3 * float(np.mean(processor[f"{count}|image to decision"]))
        cells = " | ".join(f"{m:.1f}" for m in ms)
        yield f"| {count} | {seen:.1f} | {cells} | {spent:.1f} | {ms[-1] / seen:.1f} |"


def against_budgets(samples: Samples, conditions: Conditions) -> Iterator[str]:
    """Yield the table of all steps."""
    yield "| step | samples | median, s | p95, s | processor, s | budget, s | paper, s | paper / ours |"
    yield "|---|---|---|---|---|---|---|---|"
    budgets = BUDGETS if conditions.perception == Conditions().perception else OWN_EYES
    for name, budget in budgets.items():
        wall = samples["wall"][name]
        median, p95 = np.percentile(wall, [50, 95])
        spent = np.median(samples["processor"][name])
        limits = f"{budget.median_s:g}" + ("" if np.isnan(budget.p95_s) else f" / {budget.p95_s:g}")
        paper = (
            ("-", "-")
            if np.isnan(budget.paper_s)
            else (f"{budget.paper_s:g}", f"{budget.paper_s / median:.0f} x")
        )
        times = f"{median:.3f} | {p95:.3f} | {spent:.3f}"
        yield f"| {name} | {len(wall)} | {times} | {limits} | {paper[0]} | {paper[1]} |"
    memory, kernels = samples["memory"], samples["kernels"]
    once_ms = 1e3 * memory["seconds"][0]
    yield f"\nOne pass over what a look reads and writes ({memory['MB'][0]:.0f} MB): {once_ms:.1f} ms."
    total = [sum(of) for of in zip(*kernels.values())]
    yield f"A look at ten objects, in one thread: {total[0]:.0f} calls of kernels, {1e3 * total[1]:.0f} ms in them:\n"
    yield "| kernel | calls | ms |"
    yield "|---|---|---|"
    for name, (calls, seconds) in sorted(kernels.items(), key=lambda item: -item[1][1])[:12]:
        yield f"| {name} | {calls:.0f} | {1e3 * seconds:.1f} |"


if __name__ == "__main__":
    main(tyro.cli(Args))
