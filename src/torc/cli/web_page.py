"""What `torc human` and `torc view` have in common: the local server."""

import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from torc.errors import MissingDependencyError, extra_remedy

if TYPE_CHECKING:
    from torc.web.app import TrialList
    from torc.web.frames import FrameBoard
    from torc.web.session import Session
    from torc.web.shelf import Shelf


def web_parts() -> None:
    """Raises MissingDependencyError where the server's libraries are not installed."""
    if not all(find_spec(library) for library in ("starlette", "uvicorn")):
        raise MissingDependencyError("The local web server", extra_remedy("web"))


@contextmanager
def served_page(
    shelf: "Shelf",
    trials: "TrialList",
    session: "Session | None",
    frames: "FrameBoard | None",
    host: str,
    port: int,
    open_browser: bool,
) -> Iterator[None]:
    """Serve the page during the block, and say where. Raises InputError where host or port cannot be used."""
    from torc.web.access import check_port, is_loopback, token_for
    from torc.web.app import Site, make_app
    from torc.web.serving import address, listen, serving

    check_port(port)
    token = token_for(host)

    def make(real_port: int) -> Any:
        return make_app(Site(shelf, trials, session, frames, token, real_port))

    with serving(make, listen(host, port)) as real_port:
        where = address(host, real_port, token)
        print(f"Open {where}\nCtrl-C ends it.", flush=True)
        if not is_loopback(host):
            print(
                "Whoever has that address can use the page. It is not encrypted: use it in a network that you trust."
            )
        if open_browser:
            webbrowser.open(where)
        yield
