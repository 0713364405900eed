"""The addresses that the pages use. Everything shown can be requested again at any time."""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from torc.drawing.strip import crop_around_objects
from torc.errors import InputError
from torc.io.reading import read_bytes
from torc.trials.recorded import RecordedTrial
from torc.trials.viewer_links import REPORT, served_links
from torc.web.frames import FrameBoard, jpeg, pack_view
from torc.web.pick_page import pick_page, trial_page
from torc.web.serving import Gate
from torc.web.session import Choice, RefusedError, Session
from torc.web.shelf import HumanQueue, Shelf

_PAGE = Path(__file__).parent / "page"
_POLL_S, _HEARTBEAT_S, _FRAME_WAIT_S = 0.05, 10.0, 8.0
_MAX_REPORT_BYTES = 128 * 2**20
_REPORT_POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""What a report may load: nothing, and no script. It may come from a stranger, with the trials."""
_WIDTH = 200
"""Of a thumbnail, pixels."""
_MAX_PIXELS = 4096 * 4096
_Body = TypeVar("_Body")


@dataclass(frozen=True)
class Site:
    """The content of a server: trials on disk; the queue and the session of experts, if they play; pictures of the
    working robot from outside, if they are shown.
    """

    shelf: Shelf
    queue: HumanQueue | None = None
    session: Session | None = None
    frames: FrameBoard | None = None


class _Start(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    trial: str


def make_app(site: Site, token: str | None, port: int) -> Starlette:
    """Return the server's application; set its `state.closing` when the server ends.

    `token` is None if only this machine reaches the server, which listens on `port`.
    """
    app = _App(site)
    trial, pick = "/api/trials/{key}", "/api/trials/{key}/picks/{pick:int}"
    routes = [
        Route("/api/trials", app.trials),
        Route(trial, app.of_trial(lambda trial: _json(trial_page(trial)))),
        Route(f"{trial}/video.mp4", app.of_trial(_video)),
        Route(pick, app.of_trial(lambda trial, number: _json(pick_page(trial, number)))),
        Route(f"{pick}/seen.png", app.picture(RecordedTrial.picture)),
        Route(f"{pick}/plain.png", app.picture(RecordedTrial.plain_picture)),
        Route(f"{pick}/sent/{{which:int}}.png", app.picture(RecordedTrial.sent_picture)),
        Route(f"{pick}/belief.png", app.picture(RecordedTrial.belief)),
        Route(f"{pick}/small.jpg", app.picture(thumbnail, "image/jpeg")),
        Route(f"{pick}/arrays", app.of_trial(_arrays)),
    ]
    if site.session is None:
        routes.append(Route("/report", app.report))
    else:
        expert = _Expert(site.session)
        routes += [
            Route("/api/session", expert.state),
            Route("/api/session/changes", expert.changes),
            Route("/api/session/start", expert.start, methods=["POST"]),
            Route("/api/session/choose", expert.choose, methods=["POST"]),
        ]
    if site.frames is not None:
        routes.append(Route("/api/robot.jpg", _newest(site.frames)))
    zipped = Middleware(GZipMiddleware, minimum_size=1000, compresslevel=1)
    return _served("index.html", routes, Middleware(Gate, token=token, port=port), zipped)


def make_camera_app(board: FrameBoard, token: str | None, port: int) -> Starlette:
    """Return the application of `torc camera show`: the newest picture and the facts about it; see `make_app`."""
    routes = [Route("/api/camera.jpg", _newest(board))]
    return _served("camera.html", routes, Middleware(Gate, token=token, port=port))


def _served(page: str, routes: Sequence[BaseRoute], *middleware: Middleware) -> Starlette:
    def home(request: Request) -> Response:
        return FileResponse(_PAGE / page)

    everything = [Route("/", home), Mount("/page", StaticFiles(directory=_PAGE)), *routes]
    app = Starlette(routes=everything, middleware=middleware, exception_handlers={InputError: _explained})
    app.state.closing = threading.Event()
    return app


def _newest(board: FrameBoard) -> Callable[[Request], Any]:
    """Return the address of the next picture after number `after`, with its facts."""

    async def picture(request: Request) -> Response:
        """Answer as soon as there is one; 204 if there is none for a while."""
        after = request.query_params.get("after", "0")
        seen = int(after) if after.isdecimal() and len(after) < 16 else 0
        for _ in range(round(_FRAME_WAIT_S / _POLL_S)):
            number, content, facts = board.watch()
            if number not in (0, seen):
                # ASCII: headers hold nothing else.
                headers = {"X-Frame": str(number), "X-Facts": json.dumps(facts)}
                return Response(content, media_type="image/jpeg", headers=headers)
            if request.app.state.closing.is_set() or await request.is_disconnected():
                break
            await asyncio.sleep(_POLL_S)
        return Response(status_code=204)

    return picture


class _App:
    def __init__(self, site: Site) -> None:
        self._site = site

    def report(self, request: Request) -> Response:
        """Return the page that `torc report` wrote, with links to the trials on this server."""
        root = self._site.shelf.root
        if not self._has_report:
            raise InputError(f"There is no report here yet: `torc report {root}` writes it.")
        page = served_links(read_bytes(root / REPORT, _MAX_REPORT_BYTES, "the report"))
        return Response(page, media_type="text/html", headers={"Content-Security-Policy": _REPORT_POLICY})

    def trials(self, request: Request) -> Response:
        site = self._site
        facts = {"mode": "human" if site.session else "view", "outside": site.frames is not None}
        return _json({**facts, "report": self._has_report, "trials": (site.queue or site.shelf).lines()})

    def of_trial(self, answer: Callable[..., Response]) -> Callable[[Request], Response]:
        """Return what answers with the trial of an address, and the numbers that follow in it."""

        def answered(request: Request) -> Response:
            key, *numbers = request.path_params.values()
            trial, queue = self._site.shelf.read(key), self._site.queue
            if queue is not None and queue.withholds(trial):
                raise InputError(
                    "This problem is still to be played. Its trials can be looked at afterwards."
                )
            return answer(trial, *numbers)

        return answered

    def picture(self, read: Callable[..., bytes], kind: str = "image/png") -> Callable[[Request], Response]:
        return self.of_trial(lambda trial, *numbers: Response(read(trial, *numbers), media_type=kind))

    @property
    def _has_report(self) -> bool:
        report = self._site.shelf.root / REPORT
        return report.is_file() and not report.parent.is_symlink()


class _Expert:
    def __init__(self, session: Session) -> None:
        self._session = session

    def state(self, request: Request) -> Response:
        return _json(asdict(self._session.state))

    def changes(self, request: Request) -> Response:
        """Stream server-sent events: the state now, and whenever it changes."""
        return StreamingResponse(self._states(request.app.state.closing), media_type="text/event-stream")

    async def start(self, request: Request) -> Response:
        self._session.start((await _body(request, TypeAdapter(_Start))).trial)
        return self.state(request)

    async def choose(self, request: Request) -> Response:
        self._session.choose(await _body(request, TypeAdapter(Choice)))
        return self.state(request)

    async def _states(self, closing: threading.Event) -> AsyncIterator[str]:
        told, waited = -1, 0.0
        while not closing.is_set():
            state = self._session.state
            if state.version != told:
                told, waited = state.version, 0.0
                yield f"data: {json.dumps(asdict(state))}\n\n"
            elif waited > _HEARTBEAT_S:
                # Shows a page that receives nothing that the connection is gone.
                waited = 0.0
                yield "event: alive\ndata: {}\n\n"
            await asyncio.sleep(_POLL_S)
            waited += _POLL_S


def _arrays(trial: RecordedTrial, number: int) -> Response:
    view = trial.view(number)
    if view is None:
        raise InputError("This trial was recorded without its arrays: no masks, no 3-D.")
    return Response(pack_view(view), media_type="application/octet-stream")


def _video(trial: RecordedTrial) -> Response:
    if trial.video is None:
        raise InputError("This trial has no video.")
    return FileResponse(trial.video, media_type="video/mp4")


def _json(data: Any, status: int = 200) -> Response:
    try:
        # ASCII, since text from a stranger may hold half a surrogate pair, which UTF-8 refuses.
        text = json.dumps(data, allow_nan=False)
    except (ValueError, RecursionError) as error:
        raise InputError(f"This trial holds numbers or text that cannot be shown: {error}.") from None
    return Response(text, status, media_type="application/json")


async def _body(request: Request, model: TypeAdapter[_Body]) -> _Body:
    """Return the request's JSON, checked. Raises InputError."""
    if request.headers.get("content-type", "").split(";")[0].strip() != "application/json":
        # Other sites' forms cannot send this type.
        raise InputError("Send JSON, with Content-Type: application/json.")
    try:
        return model.validate_json(await request.body())
    except ValidationError:
        raise InputError("This is not what the page sends. Reload it.") from None


async def _explained(request: Request, error: Exception) -> Response:
    wrong = 404 if request.method == "GET" else 400
    return _json({"error": str(error)}, 409 if isinstance(error, RefusedError) else wrong)


def thumbnail(trial: RecordedTrial, number: int) -> bytes:
    """Return the planner's picture at a pick as JPEG, cropped to the objects, its choice ringed in white.

    Raises InputError if there is no picture.
    """
    png = trial.plain_picture(number) if trial.has_plain_picture(number) else trial.picture(number)
    # Width and height are in the first chunk: nothing huge is unpacked.
    width, height = (int.from_bytes(png[i : i + 4], "big") for i in (16, 20))
    small = width * height <= _MAX_PIXELS
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR_RGB) if small else None
    if image is None:
        raise InputError("The picture of this pick is damaged or too large.")
    view, decided = trial.view(number), trial.pick(number).decided
    if view is not None and view.label_image.shape == image.shape[:2]:
        if decided is not None and decided.object_id is not None:
            mask = (view.label_image == decided.object_id).astype(np.uint8)
            image[cv2.dilate(mask, np.ones((9, 9), np.uint8)) > mask] = 255
        image = image[crop_around_objects(view.label_image.astype(np.int16))]
    rows = max(1, round(_WIDTH * image.shape[0] / image.shape[1]))
    return jpeg(cv2.resize(image, (_WIDTH, rows), interpolation=cv2.INTER_AREA).astype(np.uint8))
