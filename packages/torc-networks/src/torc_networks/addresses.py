"""Where a network's server is: on this machine, unless its user says otherwise."""

import ipaddress
import re
import socket
from dataclasses import dataclass
from pathlib import Path

from torc import InputError

_TCP = re.compile(r"tcp://(\[[0-9a-fA-F:.]+\]|[^:/\[\]\s]+):(\d{1,5})")
_KNOCK_S = 2.0
OPEN = "What is sent there is neither encrypted nor signed, and whoever reaches the port can use it."


@dataclass(frozen=True)
class ServerConfig:
    """A network's server.

    Attributes:
        address: tcp://HOST:PORT, or ipc://PATH.
        timeout_s: longest wait for an answer. The first one may take long: networks are loaded and compiled then.
        remote: the server may be another machine; what is sent is not encrypted.
        max_mb: longest message, megabytes.
    """

    address: str
    timeout_s: float = 60.0
    remote: bool = False
    max_mb: float = 256.0

    def __post_init__(self) -> None:
        if not 0 < self.timeout_s < 1e6:
            raise InputError(f"A server's timeout_s is {self.timeout_s}; it must be above 0.")
        if not 0 < self.max_mb <= 2000:
            raise InputError(f"A server's max_mb is {self.max_mb}; it must be above 0, and at most 2000.")

    @property
    def max_bytes(self) -> int:
        """Longest message, bytes."""
        return int(self.max_mb * 2**20)


def check_address(address: str, remote: bool) -> None:
    """Raises InputError for what is no address, and for one on another machine if that is not allowed."""
    if address.startswith("ipc://") and len(address) > len("ipc://"):
        return
    host, _ = host_and_port(address)
    if not remote and not is_loopback(host):
        raise InputError(
            f"The server {address} is not on this machine. {OPEN} If the network between is yours alone, say so: "
            "the setting server.remote true; safer is a tunnel (ssh -L) to 127.0.0.1."
        )


def host_and_port(address: str) -> tuple[str, int]:
    """Of tcp://HOST:PORT. Raises InputError for anything else."""
    found = _TCP.fullmatch(address)
    if found is None or int(found[2]) > 65535:
        raise InputError(f"'{address}' is no address of a server; write tcp://127.0.0.1:5556 or ipc:///path.")
    return found[1].strip("[]"), int(found[2])


def is_loopback(host: str) -> bool:
    """Whether a host's name or number means this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def somebody_listens(address: str) -> bool:
    """Whether a connection to the address is accepted, by whomever."""
    if address.startswith("ipc://"):
        return Path(address.removeprefix("ipc://")).exists()
    try:
        with socket.create_connection(host_and_port(address), timeout=_KNOCK_S):
            return True
    except OSError:
        return False
