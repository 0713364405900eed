"""Servers for the tests of the page: over recorded trials, and over a queue that is played with fakes."""

import json
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.helpers.fake_trial import SHAPES, play_fake_trial
from torc.episode.events import Event, Planned
from torc.specs.conditions import Conditions
from torc.specs.trial import TrialSpec
from torc.testing.synthetic import Shape
from torc.trials.trial import Trial
from torc.web.app import Site, make_app
from torc.web.frames import FrameBoard
from torc.web.serving import listen, serving_app
from torc.web.session import HumanPlanner, Phase, Session, SessionState
from torc.web.shelf import HumanQueue, Shelf, make_queue


@dataclass
class Answer:
    """What a server said."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class _Stay(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_: Any) -> None:
        return None


@dataclass
class Client:
    """Plain HTTP to a server on this machine; errors and redirections are answers like others."""

    port: int
    headers: dict[str, str] = field(default_factory=dict)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def get(self, path: str, body: bytes | None = None, **headers: str) -> Answer:
        """Ask for something."""
        request = urllib.request.Request(self.url + path, body, {**self.headers, **headers})
        try:
            with urllib.request.build_opener(_Stay).open(request, timeout=60) as answer:
                return Answer(answer.status, dict(answer.headers), answer.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, dict(error.headers), error.read())

    def post(self, path: str, data: Any, **headers: str) -> Answer:
        """Send JSON, or bytes as they are."""
        body = data if isinstance(data, bytes) else json.dumps(data).encode()
        return self.get(path, body, **{"Content-Type": "application/json", **headers})


@contextmanager
def served(
    root: Path,
    session: Session | None = None,
    queue: HumanQueue | None = None,
    board: FrameBoard | None = None,
    token: str | None = None,
    port: int = 0,
    only: str = "",
) -> Iterator[Client]:
    """A server for the trials below `root`, as `torc view` starts it; with a session, as `torc human` does."""
    shelf = Shelf(root, only)
    site = Site(shelf, queue, session, board)
    sock = listen("127.0.0.1", port)
    real_port = sock.getsockname()[1]
    with serving_app(make_app(site, token, real_port), sock):
        yield Client(real_port)


class Game:
    """A queue of fake trials, played in a thread of its own.

    Attributes:
        may_move: cleared, the robot waits before its motion.
        board: pictures from outside; None without them.
        names: perception's own ids by the shapes', where it has such.
    """

    def __init__(
        self,
        root: Path,
        problems: Sequence[str] = ("one",),
        experts: Sequence[str] = ("anna",),
        shapes: Sequence[Shape] = SHAPES,
        outside_view: bool = False,
        names: Mapping[int, int] | None = None,
    ) -> None:
        self.root, self.session, self._shapes, self._names = root, Session(), shapes, names
        self.board = FrameBoard() if outside_view else None
        root.mkdir(parents=True, exist_ok=True)
        self.queue = make_queue(problems, experts, root, 0, Conditions(), outside_view=outside_view)
        self.may_move = threading.Event()
        self.may_move.set()
        threading.Thread(target=self.queue.play, args=(self.session, self._play), daemon=True).start()

    @contextmanager
    def served(self, port: int = 0) -> Iterator[Client]:
        """Its server."""
        with served(self.root, self.session, self.queue, self.board, port=port) as client:
            yield client

    def wait(self, phase: Phase, pick: int | None = None, seconds: float = 120) -> SessionState:
        """The state once the session is in this phase, of this pick. Raises TimeoutError."""
        for _ in range(round(seconds / 0.02)):
            state = self.session.state
            if state.phase == phase and pick in (None, state.pick):
                return state
            time.sleep(0.02)
        raise TimeoutError(f"still {self.session.state}")

    def _play(self, spec: TrialSpec, out: Path) -> Trial:
        def move(event: Event) -> None:
            if isinstance(event, Planned):
                self.may_move.wait()

        planner, tell = HumanPlanner(self.session, spec.planner.expert), self.session.show
        return play_fake_trial(spec, out, planner, [tell, move], self._shapes, names=self._names)
