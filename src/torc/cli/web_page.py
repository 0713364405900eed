"""The local server of the commands that show a page."""

import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from torc.cli.printing import tell
from torc.episode.viewer_links import VIEWER_PORT
from torc.errors import MissingDependencyError, extra_remedy

if TYPE_CHECKING:
    from torc.web.app import Site


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
def served_page(site: "Site", options: PageOptions, key: str = "") -> Iterator[None]:
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
