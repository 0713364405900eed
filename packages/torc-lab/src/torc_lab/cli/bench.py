"""`torc lab bench`: task planners against each other on a real robot."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from torc.cli.options import VlmOptions, planners_of
from torc.cli.pages import PageOptions
from torc.cli.printing import split_names, tell

if TYPE_CHECKING:
    from torc.benchmark.spec import BenchSpec
    from torc.benchmark.store import Store
    from torc_lab.lab_file import Lab
    from torc_lab.scenes.scene import Scene


@dataclass(frozen=True)
class LabBenchCommand:
    """Play every planner in every scene with the robot of a lab file, several times each, and keep all trials.

    Scenes are stored by `torc lab scene`. Before each trial you lay the scene out, torc measures whether it lies as it
    did, and asks whether the robot may begin; after it torc asks what fell and whether the target came. In a scene the
    planners take turns in random order, and you are not told which one plays.

      torc lab bench --scenes scenes/* --repeats 3 --out runs/real --page
      torc report runs/real runs/simulated --out runs/both

    Run the same command again after Ctrl-C, a crash or a power cut: what was completed stays; a trial that was
    interrupted is not scored, and is played again. Rehearse with `torc lab twin`: type `reset` there to lay out.

    Exit code 0 when all trials are completed, 1 when some are missing, 2 on bad arguments, 130 after Ctrl-C.
    """

    scenes: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="DIR...")]
    """Directories of scenes."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Directory of the benchmark; created, or continued if it exists."""
    lab: Path = Path("lab.yaml")
    """The lab file."""
    planners: Annotated[str, tyro.conf.arg(metavar="A,B,...")] = "random,dg-select"
    """Task planners, comma-separated, as for `torc bench`."""
    repeats: int = 3
    """Trials of each planner in each scene: seeds 0 to N-1."""
    order_seed: int = 0
    """Decides in which order the planners take turns."""
    threshold: float = 0.8
    """Least overlap of every object, at which a scene counts as laid out."""
    confirm: Literal["motion", "pick", "never"] = "motion"
    """Ask before each motion, before the first motion of each pick, or never within a trial."""
    limit: int | None = None
    """Play at most this many trials now; the next call continues from there."""
    dry_run: bool = False
    """Only say what would be played, and in which order."""
    page: bool = False
    """Show the live picture for laying out in a browser, too."""
    page_options: PageOptions = field(default_factory=PageOptions)
    vlm: VlmOptions = field(default_factory=VlmOptions)

    def run(self) -> int:
        """Play the trials; return the exit code."""
        from torc import InputError
        from torc.benchmark.store import Store
        from torc_lab.bench.playing import plan_lab_bench
        from torc_lab.lab_file import load_lab
        from torc_lab.scenes.scene import load_scene

        if self.limit is not None and self.limit < 1:
            raise InputError("--limit must be at least 1.")
        if not 0 < self.threshold <= 1:
            raise InputError("--threshold must be above 0 and at most 1.")
        lab, store = load_lab(self.lab), Store(self.out)
        store.check()
        found = {directory: load_scene(directory) for directory in self.scenes}
        planners = planners_of([(name, {}) for name in split_names(self.planners)], self.vlm)
        spec = plan_lab_bench(lab, [*found.values()], planners, self.repeats, self.order_seed)
        if self.dry_run:
            store.extended(spec)
            for trial in store.left(spec)[: self.limit]:
                tell(f"{trial.id[:10]}  {trial.planner.label} in {trial.problem.name}, seed {trial.seed}")
            return self._sum_up(store, spec, 0)
        with store.locked():
            return self._play(lab, store, spec, found)

    def _play(self, lab: Lab, store: Store, spec: BenchSpec, found: dict[Path, Scene]) -> int:
        from torc.benchmark.store import begin_call, end_call
        from torc_lab.bench.playing import LabBench, keep_scenes
        from torc_lab.person import Person
        from torc_lab.scenes.laying_out import live_page

        scenes = {scene.problem: scene for scene in found.values()}
        store.extend(spec, {})
        keep_scenes(store, {scene.name: directory for directory, scene in found.items()})
        facts = {"lab": lab.name, "robot": lab.robot.name, "speed": lab.safety.speed}
        own = {"threshold": self.threshold, "confirm": self.confirm, "order_seed": self.order_seed}
        begin_call(store.root, **facts, **own)
        before = len(store.left(spec))
        tell(f"{len(spec.trials)} trials, {before} to play. Ctrl-C stops the arm.")
        try:
            with live_page(self.page, self.page_options) as board:
                cache, person = self.vlm.cache(), Person()
                bench = LabBench(lab, store, spec, scenes, person, self.confirm, self.threshold, board, cache)
                bench.play(self.limit)
        except KeyboardInterrupt:
            tell("Stopped. The same command goes on from here.")
            raise
        finally:
            missing = len(store.left(spec))
            end_call(store.root, played=before - missing, missing=missing)
        return self._sum_up(store, spec, before - missing)

    def _sum_up(self, store: Store, spec: BenchSpec, played: int) -> int:
        missing = len(store.left(spec))
        tell(f"trials: {len(spec.trials)}, played: {played}, missing: {missing}")
        if missing:
            tell("The same command goes on with the missing ones.")
        if missing < len(spec.trials):
            tell(f"torc report {shlex.quote(str(store.root))}")
        return 0 if not missing or self.dry_run else 1
