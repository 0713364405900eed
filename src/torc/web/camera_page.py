"""The page of `torc camera show`: the newest picture and the facts about it."""

import asyncio
import json
import threading
from collections.abc import Mapping

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from torc.web.access import Gate
from torc.web.app import PAGE
from torc.web.frames import FrameBoard

_POLL_S, _WAIT_S = 0.05, 8.0
_HEADERS = "X-Frame", "X-Facts"


class CameraBoard(FrameBoard):
    """The newest picture, with facts by name; `task` says what the page shows, if it is not only a camera."""

    def __init__(self, task: str = "") -> None:
        super().__init__()
        self._task = {"task": task} if task else {}
        self._facts: dict[str, str] = {}
        self._lock = threading.Lock()

    def show(self, jpeg: bytes, facts: Mapping[str, str]) -> None:
        """Show the next picture."""
        with self._lock:
            self.put(jpeg)
            self._facts = dict(facts)

    def trouble(self, text: str) -> None:
        """Say why there is no next picture; the last one stays."""
        with self._lock:
            self.put(self._latest[1])
            self._facts = {"trouble": text}

    def newest(self) -> tuple[int, bytes, dict[str, str]]:
        """Return number, picture and facts, and record that the page is watched."""
        with self._lock:
            return *self.watch(), self._facts | self._task


def make_camera_app(board: CameraBoard, token: str | None, port: int) -> Starlette:
    """Return the server's application; see `torc.web.app.make_app`."""
    closing = threading.Event()

    def page(request: Request) -> Response:
        return FileResponse(PAGE / "camera.html")

    async def picture(request: Request) -> Response:
        """Return the next picture after number `after`, as soon as there is one; 204 if there is none for a while."""
        after = request.query_params.get("after", "0")
        seen = int(after) if after.isdecimal() and len(after) < 16 else 0
        for _ in range(round(_WAIT_S / _POLL_S)):
            number, jpeg, facts = board.newest()
            if number not in (0, seen):
                # ASCII: headers hold nothing else.
                headers = dict(zip(_HEADERS, (str(number), json.dumps(facts)), strict=True))
                return Response(jpeg, media_type="image/jpeg", headers=headers)
            if closing.is_set() or await request.is_disconnected():
                break
            await asyncio.sleep(_POLL_S)
        return Response(status_code=204)

    routes = [
        Route("/", page),
        Mount("/page", StaticFiles(directory=PAGE)),
        Route("/api/camera.jpg", picture),
    ]
    starlette = Starlette(routes=routes, middleware=[Middleware(Gate, token=token, port=port)])
    starlette.state.closing = closing
    return starlette
