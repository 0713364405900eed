"""`torc run`: one trial in simulation."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.vlm_options import VlmOptions
from torc.grasping.names import DEFAULT_GRASPS
from torc.pipeline.min_score import DEFAULT_MIN_SCORE
from torc.robots.names import DEFAULT_ROBOT


@dataclass(frozen=True)
class RunCommand:
    """Play one trial in simulation: the robot picks until it holds the target.

    Exit code 0 when the trial was completed (retrieved or not), 1 when it errored, 2 on bad arguments.
    """

    problem: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[PROBLEM]")] = "structured-01"
    """Name of a shipped problem (`torc problems list`) or a problem file."""
    planner: str = "dg-select"
    """Task planner: dg-select, random, oracle (tries picks out in the simulation), vlm-select, vlm-grasps,
    vlm-fixes-dg (these three ask the model --vlm), or your own as module:Class or path/to/file.py:Class."""
    grasps: str = DEFAULT_GRASPS
    """Grasp planner: geometric, or your own as module:Class or path/to/file.py:Class."""
    robot: str = DEFAULT_ROBOT
    """Robot: sda10f_2f85, or a robot description file of your own (docs/robots.md)."""
    seed: int = 0
    """Decides all random draws: same problem, planner and seed, same trial."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for results and pictures; runs/PROBLEM-PLANNER-SEED if not given."""
    max_picks: int = 15
    """Attempts, failed ones included."""
    noise: bool = False
    """Add the noise of a stereo camera: depth errors that grow with distance, lost edges, eroded masks."""
    min_score: float = DEFAULT_MIN_SCORE
    """Grasps that are less likely to deliver wait until no object has a better one; 0 keeps to the paper."""
    video: bool = False
    """Also write video.mp4 (an outside view, with what the planner saw)."""
    trajectory: bool = False
    """Also write trajectory.npz and camera.mp4: joints, commands and the camera's view 25 times a simulated second, for
    `torc export --format lerobot`. Takes about half a minute more."""
    save_records: bool = False
    """Also save each snapshot as a record (about 1 MB a pick)."""
    overwrite: bool = False
    """Replace the output directory if it exists."""
    json: Annotated[bool, tyro.conf.arg(help="Print result.json instead of progress.")] = False
    vlm: VlmOptions = field(default_factory=VlmOptions)

    def run(self) -> int:
        """Run the trial; returns the exit code."""
        from rich.console import Console
        from rich.markup import escape

        from torc.errors import InputError

        if self.max_picks < 1 or self.seed < 0:
            raise InputError("--max-picks must be at least 1 and --seed at least 0.")
        from torc.episode.progress import TerminalProgress
        from torc.episode.trial import TrialSpec, run_trial

        spec = TrialSpec(
            self.problem,
            self.planner,
            self.seed,
            self.max_picks,
            self.noise,
            self.robot,
            vlm=self.vlm.config(),
            min_score=self.min_score,
            grasps=self.grasps,
        )
        console = Console(stderr=self.json)
        out = self.out or Path("runs") / spec.default_name
        # On a terminal, a line that moves: compiling and the simulated motions take their time.
        with console.status("preparing...") as status:
            trial = run_trial(
                spec,
                out,
                listeners=[] if self.json else [TerminalProgress(console, status)],
                video=self.video,
                trajectory=self.trajectory,
                overwrite=self.overwrite,
                save_records=self.save_records,
                vlm_cache=self.vlm.cache(),
                say=lambda text: console.print(text, style="dim", highlight=False),
            )
        if self.json:
            import json

            print(json.dumps(trial.result, indent=2))
        elif trial.result["status"] == "errored":
            console.print(f"\n[bold red]errored[/]: {escape(trial.result['error'])}")
        if not self.json:
            console.print(f"Results and pictures: {escape(str(trial.directory))}", highlight=False)
        return {"completed": 0, "errored": 1, "interrupted": 130}[trial.result["status"]]
