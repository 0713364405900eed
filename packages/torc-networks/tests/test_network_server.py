"""The server lives on, whatever it is asked; Ctrl-C ends it."""

import signal
import subprocess
import sys
from contextlib import closing

import msgpack
import numpy as np
import pytest
import zmq

from network_helpers.network_servers import config_for, serving
from torc.errors import InputError, NetworkError
from torc_networks.client import NetworkClient
from torc_networks.server import NetworkServer
from torc_networks.wire import decode


def _raise(error):
    def handler(asked):
        raise error

    return handler


def _raw(address, *parts):
    """What comes back for any bytes."""
    with zmq.Context() as context, context.socket(zmq.REQ) as req:
        req.linger, req.rcvtimeo = 0, 20_000
        req.connect(address)
        req.send_multipart(parts)
        return decode(req.recv())


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        ([b"\xc1"], "cannot be read"),
        ([b""], "cannot be read"),
        ([msgpack.packb([])], "is a map"),
        ([msgpack.packb({}), b"more"], "cannot be read"),
        ([msgpack.packb({})], "no action 'None'"),
        ([msgpack.packb({"action": "dance"})], "there are health, metadata, crash"),
        ([msgpack.packb({"action": ["health"]})], "There is no action"),
        ([msgpack.packb({"action": "crash"})], "ZeroDivisionError: by nothing"),
        ([msgpack.packb({"action": "refuse"})], "give more"),
        ([msgpack.packb({"action": "strange"})], "cannot be sent"),
        ([msgpack.packb({"action": "surrogate"})], "ValueError: a name like"),
        ([msgpack.packb({"action": "number"})], "TypeError"),
    ],
)
def test_bad_requests_get_an_error_and_the_server_lives_on(parts, why):
    handlers = {
        "crash": _raise(ZeroDivisionError("by nothing")),
        "refuse": _raise(InputError("give more")),
        "strange": lambda asked: {"a": object()},
        "surrogate": _raise(ValueError("a name like \udcff")),
        "number": lambda asked: 3,
    }
    with serving(handlers) as server:
        assert why in _raw(server.address, *parts)["error"]
        assert _raw(server.address, msgpack.packb({"action": "health"})) == {"status": "ok"}


def test_somebody_who_leaves_before_the_answer_is_no_harm():
    with serving({"echo": dict}) as server:
        for _ in range(3):
            with zmq.Context() as context, context.socket(zmq.REQ) as req:
                req.linger = 100
                req.connect(server.address)
                req.send(msgpack.packb({"action": "echo"}))
        with closing(NetworkClient(config_for(server.address))) as client:
            assert client.ask("echo", n=1).values == {"n": 1}


def test_an_answer_that_is_too_long_becomes_an_error():
    with serving({"much": lambda asked: {"a": np.zeros(2000)}}) as server:
        server.max_bytes = 1000
        with (
            closing(NetworkClient(config_for(server.address))) as client,
            pytest.raises(NetworkError, match="limit"),
        ):
            client.ask("much")


@pytest.mark.parametrize("host", ["0.0.0.0", "*", "192.0.2.1", "eth0"])
def test_nobody_else_is_served_unless_the_user_says_so(host):
    with pytest.raises(InputError, match="--remote"):
        NetworkServer({}, host=host)


def test_by_default_only_this_machine_is_served():
    with NetworkServer({}, host="localhost") as named, NetworkServer({}) as server:
        assert named.address.startswith("tcp://127.0.0.1:")
        assert server.address.startswith("tcp://127.0.0.1:")
    with NetworkServer({}, host="0.0.0.0", remote=True) as server:
        assert server.address.startswith("tcp://0.0.0.0:")


def test_a_port_that_is_taken_is_refused():
    with NetworkServer({}) as first, pytest.raises(InputError, match="Choose another --port"):
        NetworkServer({}, port=int(first.address.rsplit(":", 1)[1]))
    with pytest.raises(InputError, match="--port"):
        NetworkServer({}, port=99999)


@pytest.mark.parametrize(("sent", "ignored"), [("SIGINT", False), ("SIGINT", True), ("SIGTERM", False)])
def test_a_signal_ends_it_and_it_says_what_it_serves_and_where(sent, ignored):
    """A parent may ignore Ctrl-C, as a script does for what it starts in the background."""
    code = "from torc_networks.server import serve; serve({'a': dict, 'b': dict}, 'the parts', 0)"
    handler = signal.SIG_IGN if ignored else signal.default_int_handler
    server = subprocess.Popen(
        [sys.executable, "-u", "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, handler),
    )
    assert server.stdout is not None
    line = server.stdout.readline()
    assert line.startswith("the parts answers a, b at tcp://127.0.0.1:")
    assert server.stdout.readline() == "Ctrl-C ends it.\n"
    with closing(NetworkClient(config_for(line.split()[-1]))) as client:
        assert client.ask("a", n=1).values == {"n": 1}
    server.send_signal(getattr(signal, sent))
    rest, _ = server.communicate(timeout=60)
    assert (server.returncode, rest.strip()) == (0, "")
