"""The client against real sockets: what a sound server says comes through, and whatever else happens is told."""

import sys
import threading
import time

import msgpack
import numpy as np
import pytest

from network_helpers.network_servers import answering, config_for, free_port, serving
from torc.errors import InputError, MissingDependencyError, NetworkError
from torc_networks.addresses import ServerConfig, is_listening
from torc_networks.client import NetworkClient
from torc_networks.wire import encode

SHORT_S = 0.3
"""Long enough for a loopback server that answers at once; the tests of silence wait that long."""


@pytest.fixture
def client_of():
    """Clients that are closed after the test."""
    made = []

    def make(address, timeout_s=120.0, **more):
        made.append(NetworkClient(ServerConfig(address, timeout_s, **more)))
        return made[-1]

    yield make
    for client in made:
        client.close()


def test_health_metadata_and_any_action_come_through(client_of):
    with serving({"double": lambda asked: {"twice": 2 * asked["a"]}}) as server:
        client = client_of(server.address)
        assert client.ask("health").values["status"] == "ok"
        assert client.ask("metadata").values["actions"] == ["double"]
        twice = client.ask("double", a=np.array([1.5, 2.0])).finite("twice", (2,))
        assert twice.tolist() == [3.0, 4.0]


def test_an_absent_server_is_told_at_once(client_of):
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(NetworkError, match=r"nothing listens there\. Start it") as told:
        client_of(address, timeout_s=600).ask("dance")
    assert (told.value.address, told.value.action) == (address, "dance")
    assert address in str(told.value)
    assert "'dance'" in str(told.value)


def test_a_slow_server_is_told_and_its_late_answer_never_taken(client_of):
    wait = threading.Event()

    def slow(asked):
        wait.wait(20 if asked["n"] == 1 else 0)
        return {"n": asked["n"]}

    with serving({"echo": slow}) as server:
        client = client_of(server.address, SHORT_S)
        try:
            with pytest.raises(NetworkError, match=r"nothing came within 0.3 s.*timeout_s"):
                client.ask("echo", n=1)
            assert client._socket is None  # what was not sent yet never will be
        finally:
            wait.set()
        client.config = config_for(server.address)
        assert client.ask("echo", n=2).values["n"] == 2


def test_after_a_timeout_a_server_that_is_back_is_found(client_of):
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    client = client_of(address)
    for n in range(2):
        # ZeroMQ gives the port of a server that ended free in a thread of its own.
        while is_listening(address):
            time.sleep(0.01)
        with pytest.raises(NetworkError, match="nothing listens"):
            client.ask("health")
        with serving({}, port):
            assert client.ask("health").values["status"] == "ok", n


def test_a_server_that_dies_before_it_answers_is_told(client_of):
    with answering(lambda parts: None) as address, pytest.raises(NetworkError, match="nothing came within"):
        client_of(address, 4 * SHORT_S).ask("health")


def test_requests_that_were_interrupted_do_not_block_the_next(client_of):
    with serving({"echo": dict}) as server:
        for n in range(50):
            client = client_of(server.address)
            client.ask("health")
            kept = client._socket
            kept.send(encode({"action": "echo", "n": -1}))  # and nobody fetches the answer
            assert client.ask("echo", n=n).values == {"n": n}
            assert client._socket is kept


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        ([b"\xc1"], "cannot be read"),
        ([b""], "cannot be read"),
        ([msgpack.packb([1])], "is a map"),
        ([msgpack.packb({}), b"more"], "2 parts"),
        (
            [msgpack.packb({b"nd": True, b"kind": b"O", b"data": b"cos\nsystem\n(S'false'\ntR."})],
            "cannot be read",
        ),
        ([msgpack.packb({"error": "CUDA out of memory"})], "it says: CUDA out of memory"),
        ([msgpack.packb({"error": "x" * 100_000})], "x{500} See"),
        ([msgpack.packb({"error": {"code": 3}})], "it says: {'code': 3}"),
    ],
)
def test_an_error_or_nonsense_is_told_and_the_next_request_works(parts, why, client_of):
    replies = [parts, [msgpack.packb({"status": "ok"})]]
    with answering(lambda asked: replies.pop(0)) as address:
        client = client_of(address)
        with pytest.raises(NetworkError, match=why):
            client.ask("health")
        assert client.ask("health").values == {"status": "ok"}


def test_an_answer_that_is_too_long_is_not_taken(client_of):
    with serving({"much": lambda asked: {"a": np.zeros(asked["n"], np.uint8)}}) as server:
        client = client_of(server.address, max_mb=0.1)
        assert len(client.ask("much", n=90_000).values["a"]) == 90_000
        client.config = ServerConfig(server.address, SHORT_S, max_mb=0.1)
        client.close()
        with pytest.raises(NetworkError, match=r"more than 0.1 MB \(server.max_mb\)"):
            client.ask("much", n=200_000)


def test_a_request_that_is_too_long_is_not_sent(client_of):
    with serving({}) as server, pytest.raises(NetworkError, match=r"10485 is the limit"):
        client_of(server.address, max_mb=0.01).ask("segment", rgb=np.zeros((100, 100, 3), np.uint8))


@pytest.mark.parametrize("host", ["10.0.0.7", "gpu.example", "0.0.0.0", "[2001:db8::1]", "127.evil.example"])
def test_another_machine_is_asked_only_where_the_user_says_so(host):
    with pytest.raises(InputError, match=r"server.remote true"):
        NetworkClient(ServerConfig(f"tcp://{host}:5556"))
    NetworkClient(ServerConfig(f"tcp://{host}:5556", remote=True))


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "localhost", "[::1]"])
def test_this_machine_is_asked_without_a_word(host):
    NetworkClient(ServerConfig(f"tcp://{host}:5556"))


@pytest.mark.parametrize(
    "address",
    ["", "127.0.0.1:5556", "tcp://127.0.0.1", "tcp://:5556", "tcp://127.0.0.1:99999", "http://127.0.0.1:1"],
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(InputError, match="is not a server's address"):
        NetworkClient(ServerConfig(address))


@pytest.mark.parametrize(
    "wrong", [{"timeout_s": 0.0}, {"timeout_s": float("nan")}, {"max_mb": 0.0}, {"max_mb": 1e9}]
)
def test_settings_of_a_server_without_sense_are_refused(wrong):
    with pytest.raises(InputError):
        ServerConfig("tcp://127.0.0.1:5556", **wrong)


@pytest.mark.parametrize("library", ["zmq", "msgpack"])
def test_what_is_not_installed_is_told_with_its_remedy(library, client_of, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingDependencyError, match="scripts/setup networks"):
        client_of("tcp://127.0.0.1:9").ask("health")
