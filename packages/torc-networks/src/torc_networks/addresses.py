"""Where a network's server is: on this machine, unless the user says otherwise."""

import ipaddress
import socket
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from torc import InputError

_CONNECT_S = 2.0
OPEN = "Messages are neither encrypted nor signed, and whoever reaches the port can use it."


@dataclass(frozen=True)
class ServerConfig:
    """A network's server.

    Attributes:
        address: tcp://HOST:PORT, or ipc://PATH.
        timeout_s: longest wait for an answer. The first one may take long, while networks are loaded and compiled.
        remote: allow another machine; messages are not encrypted.
        max_mb: longest message, megabytes.
    """

    address: str
    timeout_s: float = 60.0
    remote: bool = False
    max_mb: float = 256.0

    def __post_init__(self) -> None:
        if not (0 < self.timeout_s < 1e6 and 0 < self.max_mb <= 2000):
            raise InputError("A server's timeout_s must be above 0, its max_mb above 0 and at most 2000.")

    @property
    def max_bytes(self) -> int:
        """Longest message, bytes."""
        return int(self.max_mb * 2**20)


def check_address(address: str, remote: bool) -> None:
    """Raise InputError if the address is malformed, or on another machine while `remote` is False."""
    if address.startswith("ipc://") and address != "ipc://":
        return
    host, _ = host_and_port(address)
    if not remote and not is_loopback(host):
        raise InputError(
            f"The server {address} is not on this machine. {OPEN} If the network between is yours alone, say so: "
            "the setting server.remote true; safer is a tunnel (ssh -L) to 127.0.0.1."
        )


def host_and_port(address: str) -> tuple[str, int]:
    """Split tcp://HOST:PORT. Raises InputError for anything else."""
    try:
        parts = urlsplit(address)
        plain = address == f"tcp://{parts.netloc}" and "@" not in address
        if plain and parts.hostname and parts.port is not None:
            return parts.hostname, parts.port
    except ValueError:
        pass
    raise InputError(
        f"'{address}' is not a server's address; write tcp://127.0.0.1:5556 or ipc:///path."
    ) from None


def is_loopback(host: str) -> bool:
    """Check whether a host's name or number means this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_listening(address: str) -> bool:
    """Check whether anything accepts a connection to the address."""
    if address.startswith("ipc://"):
        return Path(address.removeprefix("ipc://")).exists()
    try:
        with socket.create_connection(host_and_port(address), timeout=_CONNECT_S):
            return True
    except (OSError, UnicodeError):  # the latter for a name that cannot be a host's
        return False
