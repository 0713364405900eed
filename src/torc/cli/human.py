"""`torc human`: a person as task planner."""

from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from torc.cli.options import split_names
from torc.cli.web_page import PageOptions, check_web_libraries, served_page
from torc.specs.conditions import Conditions

if TYPE_CHECKING:
    from torc.episode.trial import Trial
    from torc.specs.trial import TrialSpec
    from torc.web.frames import FrameBoard
    from torc.web.session import Session


@dataclass(frozen=True)
class HumanCommand:
    """Choose the objects yourself: a local page shows what the task planners see, and the robot does what you choose.

    You see no more than they do: not the robot at work, which would show hidden things. --video films it from outside,
    for later; with --outside-view you watch, and the trials count as references.

    Every expert plays every problem. Each trial is recorded like any other (`torc view DIR` shows it). Run the same
    command again to continue: complete trials are skipped, interrupted ones start again from their beginning.

    Exit code 0 when everything is complete, 130 after Ctrl-C before that, 2 on bad arguments.
    """

    problems: tyro.conf.Positional[tuple[str, ...]] = ("structured-01",)
    """Problems, problem sets, problem files, or directories of them (`torc problems list`)."""
    experts: str = ""
    """Names of the people, comma-separated; each plays every problem. They are kept with the trials."""
    seed: int = 0
    """Decides all random draws."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")] = Path("runs/human")
    """Where the trials are recorded, a directory each."""
    video: bool = False
    """Also write video.mp4 of each trial: the robot from outside. The page shows it once nobody has to play the problem
    any more."""
    outside_view: bool = False
    """Show the robot from outside while it works. You then see more than planners do, so that these trials stand apart
    in reports, as references, and are not ranked."""
    page: PageOptions = field(default_factory=PageOptions)
    conditions: Conditions = field(default_factory=Conditions)

    def run(self) -> int:
        """Play until everything is complete, then keep the page until Ctrl-C."""
        import threading

        check_web_libraries()
        from torc.pipeline.building import build_system
        from torc.problems.problem import load_problem
        from torc.problems.sets import select_problems
        from torc.web.app import Site
        from torc.web.frames import FrameBoard
        from torc.web.human_queue import make_queue
        from torc.web.session import Session
        from torc.web.shelf import Shelf

        problems, experts = select_problems(",".join(self.problems)), split_names(self.experts)
        for problem in problems:
            load_problem(problem)
        build_system(self.conditions)
        queue = make_queue(
            problems, experts, self.out, self.seed, self.conditions, outside_view=self.outside_view
        )
        self.out.mkdir(parents=True, exist_ok=True)
        lines = queue.lines()
        print(f"{len(lines)} trials, {sum(t['status'] == 'completed' for t in lines)} of them complete.")
        if begun := [t["name"] for t in lines if t["status"] in ("interrupted", "errored")]:
            print(f"Not complete, and played again from the beginning: {', '.join(begun)}.")
        if self.outside_view:
            print(
                "With the view from outside you see more than planners do: these trials are references, not ranked."
            )
        session, board = Session(), FrameBoard() if self.outside_view else None
        try:
            with served_page(Site(Shelf(self.out), queue, session, board), self.page):
                queue.play(session, lambda spec, out: self._play(spec, out, session, board))
                print("Everything is complete. The page stays until Ctrl-C.", flush=True)
                threading.Event().wait()
        except KeyboardInterrupt:
            left = len(queue.waiting())
            more = "; the same command goes on with them." if left else "."
            print(f"\n{left} of {len(queue.trials)} trials are left{more}")
        return 130 if queue.waiting() else 0

    def _play(self, spec: "TrialSpec", out: Path, session: "Session", board: "FrameBoard | None") -> "Trial":
        from torc.episode.trial import Recording, run_trial
        from torc.web.expert import HumanPlanner, SessionListener
        from torc.web.frames import RobotCamera

        session.publish(message="Preparing the simulation")
        with nullcontext() if board is None else RobotCamera(board) as camera:
            trial = run_trial(
                spec,
                out,
                planner=HumanPlanner(session, spec.planner.expert),
                listeners=[SessionListener(session)],
                recording=Recording(self.video, observers=() if camera is None else (camera.observe,)),
                overwrite=True,
                say=lambda text: session.publish(message=text),
            )
        print(f"{out.name}: {trial.result.status}, {trial.result.end or ''}", flush=True)
        return trial
