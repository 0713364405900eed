"""Golden logs: thirty trials that a change without effect on results must not change.

python -m tools.golden record runs/golden     # before the change
python -m tools.golden check runs/golden      # after it: plays them again, and names every difference

Three planners, two kinds of eyes, five problems. Wall times, versions and the explanations of a decision
(`evidence`, `bound`) do not count: the schema of logs may change, what is seen and done may not. The digests in the
log cover depth, masks, grasps and motions bit for bit, so a recording holds on the machine that made it.
"""

import json
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from tools.running import exit_code
from torc.errors import TorcError
from torc.specs.trial import TrialSpec
from torc.vlm.config import VlmConfig

PLAYED = (
    ("dg-select", "labels"),
    ("dg-select", "embedded"),
    ("belief", "labels"),
    ("belief", "embedded"),
    ("vlm-fixes-dg", "labels"),
    ("random", "embedded"),
)
"""Planner and perception; the simulated VLM knows objects by the simulator's ids alone."""
PROBLEMS = ("structured-04", "unstructured-07", "validation-structured-02", "deep-03", "cupboard-05")
_UNCOUNTED = {"seconds", "versions", "evidence", "bound", "vlm_use", "format"}


@dataclass(frozen=True)
class Record:
    """Play the trials and keep their logs."""

    directory: tyro.conf.Positional[Path]
    workers: int = 2
    """Processes."""

    def run(self) -> None:
        """Write one JSON file per trial."""
        self.directory.mkdir(parents=True, exist_ok=True)
        for name, log in played(self.workers):
            (self.directory / f"{name}.json").write_text(json.dumps(log, indent=1), encoding="utf-8")
            print(name, flush=True)


@dataclass(frozen=True)
class Check:
    """Play the trials again and compare their logs with those that were kept."""

    directory: tyro.conf.Positional[Path]
    workers: int = 2
    """Processes."""

    def run(self) -> None:
        """Print every difference. Raises TorcError if there is one."""
        changed = 0
        for name, log in played(self.workers):
            kept = json.loads((self.directory / f"{name}.json").read_text(encoding="utf-8"))
            found = list(differences(kept, json.loads(json.dumps(log))))
            changed += bool(found)
            print(f"{name}: {'equal' if not found else '; '.join(found[:3])}", flush=True)
        if changed:
            raise TorcError(f"{changed} of {len(PLAYED) * len(PROBLEMS)} logs have changed.")


def played(workers: int) -> Iterator[tuple[str, list[Any]]]:
    """Play all trials: each one's name and log."""
    todo = [(*who, problem) for problem in PROBLEMS for who in PLAYED]
    with ProcessPoolExecutor(workers) as pool:
        yield from zip(("-".join(one) for one in todo), pool.map(_play, todo))


def differences(kept: Any, now: Any, place: str = "") -> Iterator[str]:
    """Name the places where two logs differ."""
    if isinstance(kept, Mapping) and isinstance(now, Mapping):
        for key in sorted(kept.keys() | now.keys()):
            if key not in _UNCOUNTED:
                yield from differences(kept.get(key), now.get(key), f"{place}.{key}")
    elif isinstance(kept, list) and isinstance(now, list) and len(kept) == len(now):
        for number, (one, other) in enumerate(zip(kept, now)):
            yield from differences(one, other, f"{place}[{number}]")
    elif kept != now:
        yield f"{place}: {str(kept)[:60]} -> {str(now)[:60]}"


def _play(one: tuple[str, str, str]) -> list[Any]:
    """The lines of a trial's log, and what stands in its result.json."""
    from torc.trials.trial import run_trial

    planner, perception, problem = one
    vlm = VlmConfig("simulated", "paper") if planner.startswith("vlm") else None
    spec = TrialSpec.of(problem, planner, 0, vlm=vlm, perception=perception, max_picks=6)
    trial = run_trial(spec, None, say=lambda text: None)
    return [*(line.plain for line in trial.log), trial.result.plain]


def main() -> int:
    """Run the command."""
    commands = (
        Annotated[Record, tyro.conf.subcommand("record")] | Annotated[Check, tyro.conf.subcommand("check")]
    )
    return exit_code(tyro.cli(commands, prog="python -m tools.golden", description=__doc__))


if __name__ == "__main__":
    raise SystemExit(main())
