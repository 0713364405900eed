"""The client of all networks: ZeroMQ's REQ, messages of `torc_networks.wire`."""

from typing import Any

from torc.errors import NetworkError
from torc_networks.addresses import ServerConfig, check_address, is_listening
from torc_networks.fields import Fields
from torc_networks.wire import WireError, decode, encode, library

_START = "Start it (docs/networks.md), or give its address: the setting server.address."
_WAIT = "Raise the setting server.timeout_s, or look at the server's own messages."
_UPDATE = "Is it the server that this stage is for, and of the same version of torc? See docs/networks.md."
_MOST_TEXT = 500


class NetworkClient:
    """Asks one server. The connection is made at the first request; one request at a time.

    Args:
        config: where the server is.

    Raises:
        InputError: the address is malformed, or remote without leave.
    """

    _socket: Any = None

    def __init__(self, config: ServerConfig) -> None:
        check_address(config.address, config.remote)
        self.config = config

    def ask(self, action: str, **fields: Any) -> Fields:
        """Return the server's answer to a request. (docs/networks.md lists the actions and their fields.)

        Raises:
            NetworkError: the server is absent or slow, or answers an error or nonsense. The next request then makes a
                new connection, so that a server that came back is found.
        """
        address = self.config.address
        try:
            request = encode({"action": action, **fields}, self.config.max_bytes)
            answer = decode(self._exchanged(action, request))
        except WireError as error:
            raise NetworkError(address, action, str(error), "See docs/networks.md for its format.") from error
        if answer.get("error") is not None:
            text = str(answer["error"])[:_MOST_TEXT]
            raise NetworkError(address, action, f"it says: {text}", "See the server's own messages.")
        return Fields(answer, lambda why: NetworkError(address, action, why, _UPDATE))

    def close(self) -> None:
        """Close the connection; the next request makes a new one."""
        if self._socket is not None:
            self._socket.close(linger=0)
            self._socket = None

    def __del__(self) -> None:
        # Stages have no end of their own.
        self.close()

    def _exchanged(self, action: str, request: bytes) -> bytes:
        """Return the bytes of the answer. After a fault the connection is dropped: no late answer can come through."""
        zmq, config = library("zmq"), self.config
        answer: list[bytes] = []
        try:
            # ZeroMQ itself would wait for a server to come, all of timeout_s.
            if not is_listening(config.address):
                raise NetworkError(config.address, action, "nothing listens there.", _START)
            if self._socket is None:
                self._socket = self._opened(zmq)
            self._socket.send(request)
            answer = self._socket.recv_multipart()
        except zmq.Again:
            if not is_listening(config.address):
                why = f"nothing came within {config.timeout_s:g} s, and the server is gone."
                raise NetworkError(config.address, action, why, _START) from None
            why = f"nothing came within {config.timeout_s:g} s, or more than {config.max_mb:g} MB (server.max_mb)."
            raise NetworkError(config.address, action, why, _WAIT) from None
        except zmq.ZMQError as error:
            raise NetworkError(config.address, action, f"the connection failed: {error}.", _START) from error
        finally:
            if len(answer) != 1:
                self.close()
        if len(answer) != 1:
            raise NetworkError(config.address, action, f"it came in {len(answer)} parts, not in one.", _START)
        return answer[0]

    def _opened(self, zmq: Any) -> Any:
        made = zmq.Context.instance().socket(zmq.REQ)
        made.linger = 0
        made.sndtimeo = made.rcvtimeo = max(1, int(1000 * self.config.timeout_s))
        made.maxmsgsize = self.config.max_bytes
        made.rcvhwm = made.sndhwm = 10  # with 1, answers after an interrupted request get lost
        # Without these an interrupted request would leave a socket that can neither send nor receive.
        made.req_relaxed = made.req_correlate = True
        made.ipv6 = "[" in self.config.address
        made.connect(self.config.address)
        return made
