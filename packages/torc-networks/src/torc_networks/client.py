"""One client for all networks: ZeroMQ's REQ, messages of `torc_networks.wire`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from torc.errors import MissingDependencyError, NetworkError, extra_remedy
from torc_networks.addresses import ServerConfig, check_address, somebody_listens
from torc_networks.answers import (
    Disparity,
    Grasps,
    Masks,
    Motion,
    read_disparity,
    read_grasps,
    read_masks,
    read_motion,
)
from torc_networks.fields import Fields
from torc_networks.wire import WireError, decode, encode

_START = "Start it (docs/networks.md), or give its address: the setting server.address."
_WAIT = "Raise the setting server.timeout_s, or look at the server's own messages."
_UPDATE = "Is it the server that this stage is for, and of the same version of torc? See docs/networks.md."
_MOST_TEXT = 500


class NetworkClient:
    """Asks one server. The connection is made at the first request; one request at a time.

    Every method raises NetworkError where the server is absent, slow, or answers an error or nonsense. After that the
    next request begins with a new connection, so that a server that came back is found.

    Args:
        config: where the server is. Raises InputError for another machine that is not allowed, and for no address.
    """

    _socket: Any = None

    def __init__(self, config: ServerConfig) -> None:
        check_address(config.address, config.remote)
        self.config = config

    def health(self) -> Mapping[str, Any]:
        """What the server says of its health."""
        return self.ask("health").values

    def metadata(self) -> Mapping[str, Any]:
        """What the server says it is."""
        return self.ask("metadata").values

    def segment(self, rgb: UInt8[np.ndarray, "h w 3"], **more: Any) -> Masks:
        """Masks of the objects in a picture; `more`: prompt, depth_m, K, T_world_camera, as the server uses them."""
        return read_masks(self.ask("segment", rgb=rgb, **more))

    def stereo(
        self, left: UInt8[np.ndarray, "h w"], right: UInt8[np.ndarray, "h w"], max_disparity_px: int
    ) -> Disparity:
        """Disparity of the left one of two rectified grey pictures, of which none is larger than the given one."""
        return read_disparity(self.ask("stereo", left=left, right=right, max_disparity=max_disparity_px))

    def infer(self, points: Float32[np.ndarray, "n 3"], **more: Any) -> Grasps:
        """Grasps of one object by a GraspGen or GraspGenX server: poses of the gripper's base in the points' frame;
        `more`: num_grasps, topk_num_grasps, grasp_threshold, gripper, seed, ...
        """
        return read_grasps(self.ask("infer", point_cloud=points, **more))

    def grasps(
        self, points: Float32[np.ndarray, "n 3"], object_ids: Int[np.ndarray, "n"], **more: Any
    ) -> Grasps:
        """Grasps of all objects of a scene, by a server that wants to see their surroundings; -1 is no object's."""
        asked = self.ask("grasps", point_cloud=points, object_ids=object_ids, **more)
        return read_grasps(asked, tells_objects=True)

    def plan(
        self, start: Float[np.ndarray, "dof"], goals: Float[np.ndarray, "g dof"], **more: Any
    ) -> Motion | str:
        """A motion from the start to one of the goals (radians), or why there is none; `more`: the world, what is held,
        and a seed.
        """
        return read_motion(self.ask("plan", start=start, goals=goals, **more), len(start))

    def unusable(self, action: str, why: str) -> NetworkError:
        """The error of who finds that an answer cannot be used after all."""
        return NetworkError(self.config.address, action, why, _UPDATE)

    def ask(self, action: str, **fields: Any) -> Fields:
        """The server's answer to any request."""
        address = self.config.address
        try:
            request = encode({"action": action, **fields}, self.config.max_bytes)
            answer = decode(self._exchanged(action, request), self.config.max_bytes)
        except WireError as error:
            raise NetworkError(address, action, str(error), "See docs/networks.md for its format.") from error
        if answer.get("error") is not None:
            text = str(answer["error"])[:_MOST_TEXT]
            raise NetworkError(address, action, f"it says: {text}", "See the server's own messages.")
        return Fields(answer, lambda why: self.unusable(action, why))

    def close(self) -> None:
        """Let go of the connection; the next request makes a new one."""
        if self._socket is not None:
            self._socket.close(linger=0)
            self._socket = None

    def __enter__(self) -> "NetworkClient":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        # Stages have no end of their own.
        self.close()

    def _exchanged(self, action: str, request: bytes) -> bytes:
        """The bytes of the answer. Whatever goes wrong, the connection is dropped: no late answer can come through."""
        zmq, address = _zmq(), self.config.address
        done = False
        try:
            # ZeroMQ itself would wait for a server to come, all of timeout_s.
            if not somebody_listens(address):
                raise NetworkError(address, action, "nothing listens there.", _START)
            if self._socket is None:
                self._socket = self._opened(zmq)
            self._socket.send(request)
            parts: list[bytes] = self._socket.recv_multipart()
            done = len(parts) == 1
        except zmq.Again:
            raise self._late(action) from None
        except zmq.ZMQError as error:
            raise NetworkError(address, action, f"the connection failed: {error}.", _START) from error
        finally:
            if not done:
                self.close()
        if not done:
            raise NetworkError(address, action, f"it came in {len(parts)} parts, not in one.", _START)
        return parts[0]

    def _late(self, action: str) -> NetworkError:
        waited = f"nothing came within {self.config.timeout_s:g} s"
        if somebody_listens(self.config.address):
            most = f"or more than {self.config.max_mb:g} MB (server.max_mb)"
            return NetworkError(self.config.address, action, f"{waited}, {most}.", _WAIT)
        return NetworkError(self.config.address, action, f"{waited}, and the server is gone.", _START)

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


def _zmq() -> Any:
    try:
        import zmq
    except ImportError as error:
        raise MissingDependencyError("Talking to a network's server", extra_remedy("networks")) from error
    return zmq
