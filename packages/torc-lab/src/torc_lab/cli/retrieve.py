"""`torc retrieve`: one trial on a real robot, or on its twin."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from torc import PlannerSpec, TrialSpec
from torc.cli.options import VlmOptions, wanted_of
from torc.cli.pages import PageOptions, check_web_libraries, served_page
from torc.cli.printing import print_json
from torc.registry.settings import Settings
from torc.trials.viewer_links import trial_key

if TYPE_CHECKING:
    from torc import Wanted
    from torc_lab.lab_file import Lab


@dataclass(frozen=True)
class RetrieveCommand:
    """Retrieve the target with the robot of a lab file: look, decide, pick, until it is out.

    Asks before every motion, unless --confirm says otherwise; Ctrl-C stops the arm. Begin with --dry-run, which looks,
    decides, plans, and moves nothing; and rehearse with `torc lab twin`. Whatever torc does, have the e-stop in your
    hand.

    Exit code 0 when the trial was completed (retrieved or not), or the dry run; 1 when it errored; 130 when it was
    interrupted, or resumed after a stop; 2 on bad arguments.
    """

    lab: Path = Path("lab.yaml")
    """The lab file (`torc lab example`)."""
    target: str = ""
    """The target in words, for planners that ask a model, and for the log."""
    reference: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="PICTURE...")] = ()
    """Pictures of the target from some sides, one to five will do, by which torc knows it."""
    target_size: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="LENGTH THICKNESS")] = None
    """How long the target is, corner to corner, and the width of the narrowest tube it goes through, in metres, beside
    pictures of it; that distinguishes things that look alike."""
    planner: str = "dg-select"
    """Task planner."""
    planner_settings: Annotated[Settings, tyro.conf.Suppress, tyro.conf.Fixed] = field(default_factory=dict)
    """Settings of the task planner by dotted path: --planner.SETTING VALUE."""
    confirm: Literal["motion", "pick", "never"] = "motion"
    """Ask before each motion, before the first motion of each pick, or never."""
    dry_run: bool = False
    """Look, decide and plan once; move nothing."""
    live: bool = False
    """Show each pick in a browser as it comes, with the path of the planned motions in its 3-D view before they are
    confirmed; the page stays until Ctrl-C."""
    seed: int = 0
    """Decides all random draws."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Directory for results and pictures; runs/lab-NAME-PLANNER-SEED if not given."""
    save_records: bool = False
    """Also save each snapshot as a record (about 1 MB a pick)."""
    overwrite: bool = False
    """Replace the output directory if it exists."""
    json: Annotated[bool, tyro.conf.arg(help="Print result.json instead of progress.")] = False
    vlm: VlmOptions = field(default_factory=VlmOptions)

    def run(self) -> int:
        """Run the trial; return the exit code."""
        from torc.registry.loading import short_part_name
        from torc_lab.lab_file import load_lab
        from torc_lab.retrieval import lab_spec

        lab, wanted = load_lab(self.lab), wanted_of(self.target, self.reference, size_m=self.target_size)
        spec = lab_spec(lab, PlannerSpec(self.planner, self.vlm.config(), self.planner_settings), self.seed)
        name = f"{spec.problem}-{short_part_name(self.planner)}-{self.seed}"
        out = self.out or Path("runs") / name
        if not self.live:
            return self._play(lab, spec, wanted, out)
        check_web_libraries()
        from torc.web.app import Site
        from torc.web.shelf import Shelf

        shelf = Shelf(out.parent, only=out.name)
        with served_page(Site(shelf), PageOptions(port=0), trial_key(out.name)):
            code = self._play(lab, spec, wanted, out)
            with suppress(KeyboardInterrupt):
                threading.Event().wait()
        return code

    def _play(self, lab: Lab, spec: TrialSpec, wanted: Wanted, out: Path) -> int:
        from rich.console import Console
        from rich.markup import escape

        from torc.episode.progress import TerminalProgress
        from torc_lab.person import ask_in_terminal
        from torc_lab.retrieval import Operation, retrieve

        console = Console(stderr=self.json)
        with console.status("connecting...") as status:

            def ask(question: str) -> bool:
                status.stop()
                try:
                    return ask_in_terminal(question)
                finally:
                    status.start()

            trial = retrieve(
                lab,
                spec,
                wanted,
                out,
                Operation(self.confirm, ask, self.dry_run, self.overwrite, self.save_records),
                listeners=[] if self.json else [TerminalProgress(console, status)],
                vlm_cache=self.vlm.cache(),
                say=lambda text: console.print(text, style="dim", highlight=False),
            )
        result = trial.result.plain
        if self.json:
            print_json(result)
        else:
            if result["status"] == "errored":
                console.print(f"\n[bold red]errored[/]: {escape(result['error'])}")
            if result["status"] == "dry run":
                console.print(f"\nDry run, nothing moved. Plan: {escape(result['plan'])}")
            console.print(f"Results and pictures: {escape(str(trial.directory))}", highlight=False)
        return {"completed": 0, "dry run": 0, "errored": 1, "interrupted": 130}[result["status"]]
