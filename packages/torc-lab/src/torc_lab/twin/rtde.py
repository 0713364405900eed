"""The wires of a UR controller on the loopback interface: RTDE (port 30004), the script port 30003, and the dashboard.

Of RTDE, protocol version 2: https://www.universal-robots.com/articles/ur/interface-communication (guide "RTDE").
"""

import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Self

from torc_lab.twin.servers import Servers

RTDE_PORT, SCRIPT_PORT, DASHBOARD_PORT = 30004, 30003, 29999
"""Fixed in ur_rtde: several twins differ by their loopback address."""
_CODES = {
    "DOUBLE": "d",
    "INT32": "i",
    "UINT32": "I",
    "UINT64": "Q",
    "UINT8": "B",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
}
_OUTPUTS = {
    "timestamp": "DOUBLE",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "actual_TCP_force": "VECTOR6D",
    "robot_mode": "INT32",
    "safety_mode": "INT32",
    "runtime_state": "UINT32",
    "robot_status_bits": "UINT32",
    "safety_status_bits": "UINT32",
    "speed_scaling": "DOUBLE",
    "target_speed_fraction": "DOUBLE",
}
_PERIOD_S = 0.008
_END = (b"\nend\n", b"\nend")


def type_of(name: str) -> str:
    """The type of an RTDE variable; "NOT_FOUND" for one that this twin does not have."""
    if "_int_register_" in name:
        return "INT32"
    if "_double_register_" in name:
        return "DOUBLE"
    return _OUTPUTS.get(name, "NOT_FOUND")


class UrWires:
    """Three servers, in a `with`, that carry what a controller says and hears.

    Attributes:
        silent: no state is told any more.
    """

    def __init__(
        self,
        host: str,
        state: Callable[[], Mapping[str, Any]],
        take: Callable[[Mapping[str, Any]], None],
        run: Callable[[str], None],
        order: Callable[[str], str],
    ) -> None:
        """state: values of the outputs; take: told the inputs that came; run: a script that came; order: the answer to
        a line of the dashboard. Raises OSError if the ports are taken.
        """
        self.host, self.silent = host, False
        self._state, self._take, self._run, self._order = state, take, run, order
        self._running = True
        self._servers = Servers(
            host,
            [
                (RTDE_PORT, self._serve_rtde),
                (SCRIPT_PORT, self._serve_script),
                (DASHBOARD_PORT, self._serve_dashboard),
            ],
        )

    def __enter__(self) -> Self:
        self._servers.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self._servers.__exit__()

    def cut(self) -> None:
        """Ends all connections without a farewell."""
        self._servers.cut()

    def _serve_dashboard(self, connection: socket.socket) -> None:
        connection.sendall(b"Connected: Universal Robots Dashboard Server\n")
        with connection.makefile("r", encoding="utf-8") as lines:
            for line in lines:
                connection.sendall(f"{self._order(line.strip())}\n".encode())

    def _serve_script(self, connection: socket.socket) -> None:
        text = b""
        while data := connection.recv(65536):
            text += data
            if text.endswith(_END):
                self._run(text.decode("utf-8", "replace"))
                text = b""

    def _serve_rtde(self, connection: socket.socket) -> None:
        recipes: dict[int, list[str]] = {}
        outputs: list[str] = []
        with connection.makefile("rb") as stream:
            while header := stream.read(3):
                size, kind = struct.unpack(">HB", header)
                body = stream.read(size - 3)
                match chr(kind):
                    case "V":
                        self._say(connection, "V", b"\x01")
                    case "v":
                        self._say(connection, "v", struct.pack(">4I", 5, 11, 0, 0))
                    case "O":
                        outputs = [n for n in body[8:].decode().split(",") if n]
                        self._say(connection, "O", b"\x01" + ",".join(map(type_of, outputs)).encode())
                    case "I":
                        recipes[len(recipes) + 1] = names = [n for n in body.decode().split(",") if n]
                        told = bytes([len(recipes)]) + ",".join(map(type_of, names)).encode()
                        self._say(connection, "I", told)
                    case "S":
                        self._say(connection, "S", b"\x01")
                        told_what = connection, outputs
                        threading.Thread(target=self._publish, args=told_what, daemon=True).start()
                    case "U":
                        known = recipes.get(body[0])
                        if known is None:  # of a connection from before, which ur_rtde made again
                            return
                        values = struct.unpack(">" + "".join(_CODES[type_of(n)] for n in known), body[1:])
                        self._take(dict(zip(known, values, strict=True)))

    def _publish(self, connection: socket.socket, names: list[str]) -> None:
        """Tells the outputs as long as the connection lasts."""
        with suppress(OSError):
            while self._running:
                if not self.silent:
                    state, data = self._state(), b"\x01"
                    for name in names:
                        value = state.get(name, 0)
                        code = _CODES[type_of(name)]
                        data += struct.pack(">" + code, *(value if code[0] == "6" else (value,)))
                    self._say(connection, "U", data)
                time.sleep(_PERIOD_S)

    def _say(self, connection: socket.socket, kind: str, body: bytes) -> None:
        connection.sendall(struct.pack(">HB", 3 + len(body), ord(kind)) + body)
