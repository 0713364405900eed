"""`torc human` and `torc view`: commands that show a local page, and the server behind it."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from torc.cli.printing import split_names, tell
from torc.errors import MissingDependencyError, extra_remedy
from torc.specs.conditions import Conditions
from torc.trials.viewer_links import VIEWER_PORT

if TYPE_CHECKING:
    from torc.specs.trial import TrialSpec
    from torc.trials.trial import Trial
    from torc.web.app import Site
    from torc.web.frames import FrameBoard
    from torc.web.session import Session


@dataclass(frozen=True)
class PageOptions:
    """Where the page is served."""

    host: str = "127.0.0.1"
    """Where to listen. Anything but this machine's own addresses makes a token that the browser needs."""
    port: int = VIEWER_PORT
    """0 for any free one."""
    open: bool = False
    """Open the browser."""


def check_web_libraries() -> None:
    """Raise MissingDependencyError if the server's libraries are not installed."""
    if not all(find_spec(library) for library in ("starlette", "uvicorn")):
        raise MissingDependencyError("The local web server", extra_remedy("web"))


@contextmanager
def served_page(site: Site, options: PageOptions, key: str = "") -> Iterator[None]:
    """Serve the page during the block, and say where; it shows the trial of that key.

    Raises InputError if host or port cannot be used.
    """
    from torc.web.app import make_app

    with served_app(lambda token, port: make_app(site, token, port), options, key):
        yield


@contextmanager
def served_app(make: Callable[[str | None, int], Any], options: PageOptions, key: str = "") -> Iterator[None]:
    """Serve any application (a Starlette), made from a token, or None, and a port, during the block."""
    from torc.web.serving import address, listen, serving_app, token_for

    host, token = options.host, token_for(options.host)
    sock = listen(host, options.port)
    port = sock.getsockname()[1]
    with serving_app(make(token, port), sock):
        where = address(host, port, token) + (f"#{key}" if key else "")
        tell(f"Open {where}\nCtrl-C ends it.")
        if token:
            tell(
                "Whoever has that address can use the page. It is not encrypted: use it in a network that you trust."
            )
        if options.open:
            webbrowser.open(where)
        yield


@dataclass(frozen=True)
class ViewCommand:
    """Show recorded trials in a browser, pick by pick: what the planner saw, what it chose and why, and the outcome.

    The page is served to this machine only, and needs nothing from outside. Ctrl-C ends it.
    """

    directory: tyro.conf.Positional[Path]
    """A trial (`torc run --out DIR`), or a directory with trials anywhere in it."""
    page: PageOptions = field(default_factory=PageOptions)

    def run(self) -> int:
        check_web_libraries()
        from torc.web.app import Site
        from torc.web.shelf import open_shelf

        shelf = open_shelf(self.directory)
        try:
            with served_page(Site(shelf), self.page):
                threading.Event().wait()
        except KeyboardInterrupt:
            print()
        return 0


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
        check_web_libraries()
        from torc.pipeline.building import build_system
        from torc.problems.problem import load_problem
        from torc.problems.sets import select_problems
        from torc.web.app import Site
        from torc.web.frames import FrameBoard
        from torc.web.session import Session
        from torc.web.shelf import Shelf, make_queue

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

    def _play(self, spec: TrialSpec, out: Path, session: Session, board: FrameBoard | None) -> Trial:
        from torc.trials.trial import Recording, run_trial
        from torc.web.frames import RobotCamera
        from torc.web.session import HumanPlanner

        session.publish(message="Preparing the simulation")
        with nullcontext() if board is None else RobotCamera(board) as camera:
            trial = run_trial(
                spec,
                out,
                planner=HumanPlanner(session, spec.planner.expert),
                listeners=[session.show],
                recording=Recording(video=self.video, observers=() if camera is None else (camera.observe,)),
                overwrite=True,
                say=lambda text: session.publish(message=text),
            )
        print(f"{out.name}: {trial.result.status}, {trial.result.end or ''}", flush=True)
        return trial
