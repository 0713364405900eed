"""Find the proxy of the environment for a server; servers on this machine never use one."""

import ipaddress
import socket
from dataclasses import dataclass
from urllib.parse import unquote, urlsplit
from urllib.request import getproxies, proxy_bypass

_TOO_SHORT = 3
"""Secrets up to this length are not scrubbed: they occur in ordinary words."""


@dataclass(frozen=True)
class Proxy:
    """A proxy from the environment; its URL may hold a user and a password."""

    scheme: str
    url: str
    server: str

    def words(self) -> str:
        """Describe the proxy for an error message: its address without user and password, and how to avoid it."""
        _, address = self._parts()
        known = address or f"that {self.scheme}_proxy names (its address is malformed)"
        return f"asked through the proxy {known}; no_proxy={self.server} in the environment avoids it"

    def without_secrets(self, text: str) -> str:
        """Return a text without the proxy's user and password."""
        user, _ = self._parts()
        for secret in (user, *user.split(":", 1)):
            for form in (secret, unquote(secret)):
                text = text.replace(form, "[secret]") if len(form) > _TOO_SHORT else text
        return text

    def _parts(self) -> tuple[str, str]:
        """Return user with password, and the address without them.

        If a password seems to stand in place of the port, everything is the user and the address is empty.
        """
        scheme, mark, rest = self.url.partition("://")
        if not mark:
            scheme, rest = "http", self.url
        user, _, host = rest.partition("/")[0].rpartition("@")
        try:
            _ = urlsplit(f"//{host}").port
        except ValueError:
            return user or host, ""
        return user, f"{scheme}://{host}"


def find_proxy(url: str) -> Proxy | None:
    """Return the environment's proxy for this address (http_proxy, https_proxy).

    None if no_proxy excludes the address, or if it is on this machine, which a proxy elsewhere cannot reach.
    """
    parts = urlsplit(url)
    host = parts.hostname or ""
    given = getproxies().get(parts.scheme)
    if not given or is_loopback(host) or proxy_bypass(parts.netloc):
        return None
    return Proxy(parts.scheme, given, host)


def is_loopback(host: str) -> bool:
    """True if a host's name or address means this machine: localhost, 127.0.0.0/8, ::1, or 0.0.0.0, which servers print
    as their own address. No name is looked up.
    """
    name = host.lower().rstrip(".")
    if name == "localhost" or name.endswith(".localhost"):
        return True
    address = _address_of(name.strip("[]"))
    if address is None:
        return False
    mapped = getattr(address, "ipv4_mapped", None)
    return any(a.is_loopback or a.is_unspecified for a in (address, mapped) if a is not None)


def _address_of(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        pass
    try:  # the short forms that connect() understands, e.g. 127.1
        return ipaddress.IPv4Address(socket.inet_aton(text)) if text[:1].isdigit() else None
    except OSError:
        return None
