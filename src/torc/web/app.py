"""The addresses that the page uses. Everything shown can be requested again at any time."""

import asyncio
import json
import threading
from collections.abc import AsyncIterator
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
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from torc.drawing.strip import crop_around_objects
from torc.episode.recorded import RecordedTrial
from torc.episode.viewer_links import REPORT, served_links
from torc.errors import InputError
from torc.io.reading import read_bytes
from torc.web.access import Gate
from torc.web.frames import FrameBoard, jpeg, pack_view
from torc.web.human_queue import HumanQueue
from torc.web.pick_page import pick_page, trial_page
from torc.web.session import Choice, RefusedError, Session
from torc.web.shelf import Shelf

PAGE = Path(__file__).parent / "page"
_POLL_S, _HEARTBEAT_S, _FRAME_WAIT_S = 0.05, 10.0, 8.0
_FRAME_NUMBER = "X-Frame"
_MAX_REPORT_BYTES = 128 * 2**20
_REPORT_POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""What a report may load: nothing, and no script. It may come from a stranger, with the trials."""
_Body = TypeVar("_Body")


@dataclass(frozen=True)
class Site:
    """The content of a server.

    Attributes:
        shelf: trials on disk.
        trials: those that are listed.
        session: of the expert who plays, if one does.
        frames: pictures of the working robot from outside, if they are shown.
    """

    shelf: Shelf
    trials: Shelf | HumanQueue
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
    pick = "/api/trials/{key}/picks/{pick:int}"
    routes = [
        Route("/", app.page),
        Mount("/page", StaticFiles(directory=PAGE)),
        Route("/api/trials", app.trials),
        Route("/api/trials/{key}", app.trial),
        Route("/api/trials/{key}/video.mp4", app.video),
        Route(pick, app.pick),
        Route(f"{pick}/seen.png", app.picture),
        Route(f"{pick}/plain.png", app.plain_picture),
        Route(f"{pick}/sent/{{which:int}}.png", app.sent_picture),
        Route(f"{pick}/belief.png", app.belief),
        Route(f"{pick}/small.jpg", app.small_picture),
        Route(f"{pick}/arrays", app.arrays),
    ]
    if site.session is None:
        routes.append(Route("/report", app.report))
    else:
        routes += [
            Route("/api/session", app.state),
            Route("/api/session/changes", app.changes),
            Route("/api/session/start", app.start, methods=["POST"]),
            Route("/api/session/choose", app.choose, methods=["POST"]),
        ]
    if site.frames is not None:
        routes.append(Route("/api/robot.jpg", app.robot))
    middleware = [
        Middleware(Gate, token=token, port=port),
        Middleware(GZipMiddleware, minimum_size=1000, compresslevel=1),
    ]
    starlette = Starlette(routes=routes, middleware=middleware, exception_handlers={InputError: _explained})
    starlette.state.closing = app.closing
    return starlette


class _App:
    """The answers. `closing` is set when the server ends, so that endless answers stop."""

    def __init__(self, site: Site) -> None:
        self._site, self.closing = site, threading.Event()
        self._session, self._frames = site.session or Session(), site.frames or FrameBoard()

    def page(self, request: Request) -> Response:
        return FileResponse(PAGE / "index.html")

    def report(self, request: Request) -> Response:
        """Return the page that `torc report` wrote, with links to the trials on this server."""
        root = self._site.shelf.root
        if not self._has_report:
            raise InputError(f"There is no report here yet: `torc report {root}` writes it.")
        page = read_bytes(root / REPORT, _MAX_REPORT_BYTES, "the report")
        return Response(
            served_links(page), media_type="text/html", headers={"Content-Security-Policy": _REPORT_POLICY}
        )

    def trials(self, request: Request) -> Response:
        site = self._site
        facts = {"mode": "human" if site.session else "view", "outside": site.frames is not None}
        return _json({**facts, "report": self._has_report, "trials": site.trials.lines()})

    def trial(self, request: Request) -> Response:
        return _json({"key": request.path_params["key"], **trial_page(self._read(request))})

    def pick(self, request: Request) -> Response:
        return _json(pick_page(self._read(request), request.path_params["pick"]))

    def picture(self, request: Request) -> Response:
        return Response(self._read(request).picture(request.path_params["pick"]), media_type="image/png")

    def plain_picture(self, request: Request) -> Response:
        return Response(
            self._read(request).plain_picture(request.path_params["pick"]), media_type="image/png"
        )

    def sent_picture(self, request: Request) -> Response:
        number, which = request.path_params["pick"], request.path_params["which"]
        return Response(self._read(request).sent_picture(number, which), media_type="image/png")

    def belief(self, request: Request) -> Response:
        return Response(self._read(request).belief(request.path_params["pick"]), media_type="image/png")

    def small_picture(self, request: Request) -> Response:
        small = thumbnail(self._read(request), request.path_params["pick"])
        return Response(small, media_type="image/jpeg")

    def arrays(self, request: Request) -> Response:
        view = self._read(request).view(request.path_params["pick"])
        if view is None:
            raise InputError("This trial was recorded without its arrays: no masks, no 3-D.")
        return Response(pack_view(view), media_type="application/octet-stream")

    def video(self, request: Request) -> Response:
        path = self._read(request).video
        if path is None:
            raise InputError("This trial has no video.")
        return FileResponse(path, media_type="video/mp4")

    def state(self, request: Request) -> Response:
        return _json(asdict(self._session.state))

    def changes(self, request: Request) -> Response:
        """Stream server-sent events: the state now, and whenever it changes."""
        return StreamingResponse(self._states(), media_type="text/event-stream")

    async def start(self, request: Request) -> Response:
        self._session.start((await _body(request, TypeAdapter(_Start))).trial)
        return self.state(request)

    async def choose(self, request: Request) -> Response:
        self._session.choose(await _body(request, TypeAdapter(Choice)))
        return self.state(request)

    async def robot(self, request: Request) -> Response:
        """Return the next picture after number `after`, as soon as there is one; 204 if there is none for a while."""
        after = request.query_params.get("after", "0")
        seen = int(after) if after.isdecimal() and len(after) < 16 else 0
        for _ in range(round(_FRAME_WAIT_S / _POLL_S)):
            number, picture = self._frames.watch()
            if number not in (0, seen):
                return Response(picture, media_type="image/jpeg", headers={_FRAME_NUMBER: str(number)})
            if self.closing.is_set() or await request.is_disconnected():
                break
            await asyncio.sleep(_POLL_S)
        return Response(status_code=204)

    async def _states(self) -> AsyncIterator[str]:
        told, waited = -1, 0.0
        while not self.closing.is_set():
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

    @property
    def _has_report(self) -> bool:
        report = self._site.shelf.root / REPORT
        return report.is_file() and not report.parent.is_symlink()

    def _read(self, request: Request) -> RecordedTrial:
        trial = self._site.shelf.read(request.path_params["key"])
        if self._site.trials.withholds(trial):
            raise InputError("This problem is still to be played. Its trials can be looked at afterwards.")
        return trial


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


WIDTH = 200
MAX_PIXELS = 4096 * 4096


def thumbnail(trial: RecordedTrial, number: int) -> bytes:
    """Return the planner's picture at a pick as JPEG, cropped to the objects, its choice ringed in white.

    Raises InputError if there is no picture.
    """
    png = trial.plain_picture(number) if trial.has_plain_picture(number) else trial.picture(number)
    # Width and height are in the first chunk: nothing huge is unpacked.
    width, height = (int.from_bytes(png[i : i + 4], "big") for i in (16, 20))
    small = width * height <= MAX_PIXELS
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR_RGB) if small else None
    if image is None:
        raise InputError("The picture of this pick is damaged or too large.")
    view, decided = trial.view(number), trial.pick(number).decided
    if view is not None and view.label_image.shape == image.shape[:2]:
        if decided is not None and decided.object_id is not None:
            mask = (view.label_image == decided.object_id).astype(np.uint8)
            image[cv2.dilate(mask, np.ones((9, 9), np.uint8)) > mask] = 255
        image = image[crop_around_objects(view.label_image.astype(np.int16))]
    rows = max(1, round(WIDTH * image.shape[0] / image.shape[1]))
    return jpeg(cv2.resize(image, (WIDTH, rows), interpolation=cv2.INTER_AREA).astype(np.uint8))
