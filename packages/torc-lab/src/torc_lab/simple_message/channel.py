"""One TCP connection that carries frames of simple_message. It is lost for good at the first fault."""

import socket
import threading

from torc_lab.protocols import LabError
from torc_lab.simple_message.messages import MAX_LENGTH, ByteOrder, Frame, byte_order


class Channel:
    """A connection to a controller; may be used by several threads, one exchange at a time."""

    def __init__(self, host: str, port: int, timeout_s: float = 1.0, order: ByteOrder | None = None) -> None:
        """Connects. Without an `order`, the first frame that is received tells. Raises LabError."""
        self.name, self.order = f"{host}:{port}", order
        self._lock, self._lost = threading.Lock(), ""
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            raise LabError(
                f"The controller cannot be reached at {self.name}: {error}. Is MotoROS installed and running, and the "
                "network cable in the right socket?"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """Ends the connection."""
        self._lost = self._lost or "it was closed"
        self._socket.close()

    def ask(self, frame: Frame) -> Frame:
        """Sends a frame and receives one. Raises LabError."""
        with self._lock:
            self._check()
            try:
                self._socket.sendall(frame.pack(self.order or "big"))
                return self._receive()
            except (OSError, LabError) as error:
                raise self._lose(error) from error

    def receive(self) -> Frame:
        """The next frame. Raises LabError."""
        self._check()
        try:
            return self._receive()
        except (OSError, LabError) as error:
            raise self._lose(error) from error

    def _receive(self) -> Frame:
        length = self._exactly(4)
        if self.order is None:
            self.order = byte_order(length)
        size = int.from_bytes(length, self.order)
        if not 12 <= size <= MAX_LENGTH:
            raise LabError(f"it sent a message of {size} bytes")
        return Frame.unpack(self._exactly(size), self.order)

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = self._socket.recv(size - len(data))
            if not part:
                raise LabError("it ended the connection")
            data += part
        return data

    def _check(self) -> None:
        if self._lost:
            raise LabError(f"The connection to {self.name} is lost: {self._lost}.")

    def _lose(self, error: Exception) -> LabError:
        self._lost = self._lost or str(error) or type(error).__name__
        self._socket.close()
        return LabError(f"The connection to {self.name} is lost: {self._lost}.")
