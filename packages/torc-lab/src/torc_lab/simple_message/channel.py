"""One TCP connection that carries frames of simple_message. It is lost for good at the first fault."""

import socket
import threading

from torc_lab.link import Link
from torc_lab.protocols import LabError
from torc_lab.simple_message.messages import MAX_LENGTH, ByteOrder, Frame, byte_order


class Channel(Link):
    """A connection to a controller; several threads may use it, one exchange at a time."""

    def __init__(self, host: str, port: int, timeout_s: float = 1.0, order: ByteOrder | None = None) -> None:
        """Connect. Without an `order`, the first received frame determines it. Raises LabError."""
        super().__init__(f"The connection to {host}:{port}")
        self.order, self._lock = order, threading.Lock()
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            raise LabError(
                f"The controller cannot be reached at {host}:{port}: {error}. Is MotoROS installed and running, and "
                "the network cable in the right socket?"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        self.lost = self.lost or "it was closed"
        self._socket.close()

    def ask(self, frame: Frame) -> Frame:
        """Send a frame and return the answer. Raises LabError."""
        with self._lock:
            return self._exchange(frame.pack(self.order or "big"))

    def receive(self) -> Frame:
        """Return the next frame. Raises LabError."""
        return self._exchange(b"")

    def _exchange(self, request: bytes) -> Frame:
        self._check()
        try:
            self._socket.sendall(request)
            length = self._exactly(4)
            self.order = self.order or byte_order(length)
            size = int.from_bytes(length, self.order)
            if not 12 <= size <= MAX_LENGTH:
                raise LabError(f"it sent a message of {size} bytes")
            return Frame.unpack(self._exactly(size), self.order)
        except (OSError, LabError) as error:
            self._socket.close()
            raise self._lose(error) from error

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = self._socket.recv(size - len(data))
            if not part:
                raise LabError("it ended the connection")
            data += part
        return data
