"""`torc retrieve` over the drivers' real wires, the simulator behind them, against `torc run` on the same problems.

    python packages/torc-lab/benchmarks/lab_twins.py [--problems 10] [--labs sda10f-ros1 sda10f-simple-message]
    python packages/torc-lab/benchmarks/lab_twins.py --labs ur5e-ros2 --robot ur5e_2f85 --problem-set validation-ur5e

Takes real time: about a minute for each problem and lab, at full speed. What the robot felt and recognised is told
beside what really lies in the bin; `torc run` counts by the truth.
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from torc.benchmark.intervals import by_problem, mean, share
from torc.episode.simulated import pictured_target
from torc.problems.problem import load_problem
from torc.problems.sets import problem_names
from torc.records import TARGET_ID
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.trials.log import TrialResult
from torc.trials.trial import run_trial
from torc_lab.devices import connect_arm, connect_gripper
from torc_lab.lab_file import Lab, example_labs, load_lab
from torc_lab.protocols import PowersServos
from torc_lab.retrieval import Operation, lab_spec, retrieve


@dataclass(frozen=True)
class Args:
    """Play problems of a set in simulation, and over the wires."""

    problems: int = 10
    """So many."""
    labs: tuple[str, ...] = ("sda10f-ros1", "sda10f-simple-message")
    """Lab files that come with torc, of one robot."""
    robot: str = DEFAULT_ROBOT
    """That robot, for `torc run`."""
    problem_set: str = "validation"
    """Problems that are made for it."""
    speed: float = 1.0
    """Share of the robot's speed limits."""


@contextmanager
def twins(name: str, problem: str, speed: float, out: Path) -> Iterator[tuple[Lab, Callable[[], str]]]:
    """`torc lab twin` in a process of its own: the lab that leads to the twins, its devices powered and ready, and what
    tells the ids of what really lies in the bin.
    """
    own, twin = out / "lab.yaml", out / "twin.yaml"
    # The fingertips' limit on hardware would slow them down, too.
    fast = f"  tcp_speed_m_s: 5\n  speed: {speed} "
    own.write_text(example_labs()[name].replace("  speed: 0.1 ", fast), encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "torc.cli.main",
        "lab",
        "twin",
        problem,
        "--lab",
        str(own),
        "--out",
        str(twin),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        told = process.stdout
        try:
            next(line for line in told if line.startswith("Type one of these"))
            lab = load_lab(twin)
            gripper, arm = connect_gripper(lab), connect_arm(lab)
            gripper.activate()  # type: ignore[attr-defined]
            if isinstance(arm, PowersServos):
                arm.enable()
            gripper.disconnect()
            arm.close()

            def truth() -> str:
                print("truth", file=process.stdin, flush=True)
                return next(line for line in told if line.startswith("In the bin"))

            yield lab, truth
        finally:
            process.terminate()


def over_wires(name: str, problem_name: str, speed: float, out: Path) -> tuple[dict[str, Any], str]:
    """One trial on the twins of a lab, and what really came of it."""
    problem = load_problem(problem_name)
    wanted = pictured_target(problem)
    with twins(name, problem_name, speed, out) as (lab, truth):
        spec = lab_spec(lab, PlannerSpec("dg-select"))
        quiet = Operation("never", lambda question: False)
        trial = retrieve(lab, spec, wanted, out / "trial", quiet, say=lambda text: None)
        return trial.result, truth().strip()


def main(args: Args) -> None:
    """Prints a line per trial, and a table."""
    names = problem_names(args.problem_set)
    names = names[:: max(1, len(names) // args.problems)][: args.problems]
    rows: dict[str, list[dict[str, Any]]] = {}
    for name in names:
        with tempfile.TemporaryDirectory() as directory:
            spec = TrialSpec.of(name, perception="embedded", robot=args.robot)
            result = run_trial(spec, Path(directory) / "trial").result
            rows.setdefault("torc run", []).append({**result.plain, "brought": result.retrieved})
            print(f"{name}, torc run: {_told(result)}", flush=True)
        for lab in args.labs:
            with tempfile.TemporaryDirectory() as directory:
                result, truth = over_wires(lab, name, args.speed, Path(directory))
            rows.setdefault(lab, []).append({**result.plain, "brought": TARGET_ID in in_bin(truth)})
            print(f"{name}, {lab}: {_told(result)}. {truth}", flush=True)
    print("\n| | trials | errored | retrieved | target in the bin | picks of those retrieved | grasps held |")
    print("|---|---|---|---|---|---|---|")
    for who, results in rows.items():
        done = [(n, r) for n, r in zip(names, results) if r["status"] == "completed"]
        columns = [
            [1.0, *(float(r[k]) for k in ("retrieved", "brought", "grasps_held", "grasps_executed"))]
            for _, r in done
        ]
        one, found, brought, held, tried, picks = by_problem(
            [n for n, _ in done], *zip(*columns), [r["picks"] * float(r["retrieved"]) for _, r in done]
        )
        print(
            f"| {who} | {len(results)} | {len(results) - len(done)} | {share(found, one).text()} | "
            f"{share(brought, one).text()} | {mean(picks, found).text(1)} | {share(held, tried).text()} |"
        )


def in_bin(truth: str) -> list[int]:
    """Ids of what lies in the bin, from what the twin said."""
    return [int(k) for k in truth.partition("[")[2].partition("]")[0].split(",") if k.strip()]


def _told(result: TrialResult) -> str:
    if result.status != "completed":
        return f"{result.status}: {result.error}"
    return f"{'retrieved' if result.retrieved else result.end}, {', '.join(result.outcomes)}"


if __name__ == "__main__":
    main(tyro.cli(Args, description=__doc__))
