"""The local server of the commands that show a page."""

import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from torc.cli.printing import tell
from torc.errors import MissingDependencyError, extra_remedy

if TYPE_CHECKING:
    from torc.web.app import Site


def check_web_libraries() -> None:
    """Raises MissingDependencyError where the server's libraries are not installed."""
    if not all(find_spec(library) for library in ("starlette", "uvicorn")):
        raise MissingDependencyError("The local web server", extra_remedy("web"))


@contextmanager
def served_page(
    site: "Site", host: str, port: int, open_browser: bool = False, key: str = ""
) -> Iterator[None]:
    """Serve the page during the block, and say where; it shows the trial of that key.

    Raises InputError where host or port cannot be used.
    """
    from torc.web.access import token_for
    from torc.web.serving import address, listen, serving

    token = token_for(host)
    with serving(site, listen(host, port), token) as real_port:
        where = address(host, real_port, token) + (f"#{key}" if key else "")
        tell(f"Open {where}\nCtrl-C ends it.")
        if token:
            tell(
                "Whoever has that address can use the page. It is not encrypted: use it in a network that you trust."
            )
        if open_browser:
            webbrowser.open(where)
        yield
