"""`torc run`: one trial in simulation."""

import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.options import VlmOptions
from torc.cli.pages import PageOptions, check_web_libraries, served_page
from torc.cli.printing import print_json
from torc.registry.settings import Settings
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.trials.viewer_links import trial_key


@dataclass(frozen=True)
class RunCommand:
    """Play one trial in simulation: the robot picks until it holds the target.

    Exit code 0 when the trial was completed (retrieved or not), 1 when it errored, 2 on bad arguments.
    """

    problem: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[PROBLEM]")] = "structured-01"
    """Name of a shipped problem (`torc problems list`) or a problem file."""
    planner: str = "dg-select"
    """Task planner."""
    planner_settings: Annotated[Settings, tyro.conf.Suppress, tyro.conf.Fixed] = field(default_factory=dict)
    """Settings of the task planner by dotted path: --planner.SETTING VALUE."""
    seed: int = 0
    """Decides all random draws: same problem, planner and seed, same trial."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for results and pictures; runs/PROBLEM-PLANNER-SEED if not given."""
    live: bool = False
    """Show each pick in a browser as it comes; the page stays until Ctrl-C."""
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
    conditions: Conditions = field(default_factory=Conditions)
    vlm: VlmOptions = field(default_factory=VlmOptions)

    def run(self) -> int:
        planner = PlannerSpec(self.planner, self.vlm.config(), self.planner_settings)
        spec = TrialSpec(self.problem, planner, self.seed, self.conditions)
        out = self.out or Path("runs") / spec.default_name
        if not self.live:
            return self._play(spec, out)
        check_web_libraries()
        from torc.web.app import Site
        from torc.web.shelf import Shelf

        shelf = Shelf(out.parent, only=out.name)
        with served_page(Site(shelf), PageOptions(port=0), trial_key(out.name)):
            code = self._play(spec, out)
            with suppress(KeyboardInterrupt):
                threading.Event().wait()
        return code

    def _play(self, spec: TrialSpec, out: Path) -> int:
        from rich.console import Console
        from rich.markup import escape

        from torc.episode.progress import TerminalProgress
        from torc.trials.trial import Recording, run_trial

        console = Console(stderr=self.json)
        # On a terminal, a line that moves: compiling and the simulated motions take time.
        with console.status("preparing...") as status:
            trial = run_trial(
                spec,
                out,
                listeners=[] if self.json else [TerminalProgress(console, status)],
                recording=Recording(
                    video=self.video, trajectory=self.trajectory, snapshots=self.save_records
                ),
                overwrite=self.overwrite,
                vlm_cache=self.vlm.cache(),
                say=lambda text: console.print(text, style="dim", highlight=False),
            )
        if self.json:
            print_json(trial.result.plain)
        else:
            if trial.result.error:
                console.print(f"\n[bold red]errored[/]: {escape(trial.result.error)}")
            console.print(f"Results and pictures: {escape(str(trial.directory))}", highlight=False)
        return {"completed": 0, "errored": 1, "interrupted": 130}[trial.result.status]
