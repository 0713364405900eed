"""Servers of networks on the loopback interface, in a thread each: sound ones, and ones that do as a test says."""

import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import zmq

from torc_networks.addresses import ServerConfig
from torc_networks.server import Handler, NetworkServer


@contextmanager
def serving(handlers: Mapping[str, Handler], port: int = 0) -> Iterator[NetworkServer]:
    """torc's own server with these handlers; what it says is lost."""
    stop = threading.Event()
    with NetworkServer(handlers, "test", port, say=lambda line: None) as server:
        thread = threading.Thread(target=server.run, args=(stop,), daemon=True)
        thread.start()
        try:
            yield server
        finally:
            stop.set()
            thread.join()


@contextmanager
def answering(reply: Callable[[list[bytes]], list[bytes] | None]) -> Iterator[str]:
    """A bare REP socket's address: it answers with these parts, or hangs up without an answer."""
    with zmq.Context() as context, context.socket(zmq.REP) as rep:
        rep.linger = 0
        rep.bind("tcp://127.0.0.1:*")
        stop = threading.Event()

        def run() -> None:
            while not stop.is_set():
                if rep.poll(20):
                    parts = reply(rep.recv_multipart())
                    if parts is None:
                        rep.unbind(address)
                        return
                    rep.send_multipart(parts)

        address: str = rep.last_endpoint.decode()
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        try:
            yield address
        finally:
            stop.set()
            thread.join()


def free_port() -> int:
    """A port of the loopback interface on which nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return int(taken.getsockname()[1])


def config_for(address: str, timeout_s: float = 120.0) -> ServerConfig:
    """A client's settings for it."""
    return ServerConfig(address, timeout_s)
