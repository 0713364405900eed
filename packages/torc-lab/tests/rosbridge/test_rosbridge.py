"""The rosbridge client against a fake server: newest messages, services, and connections that fail."""

import sys

import pytest

pytest.importorskip("websockets", reason="websockets is not installed")

from lab_helpers.rosbridge_server import Broken, FakeRosbridge
from torc.errors import MissingDependencyError
from torc_lab.rosbridge.client import Rosbridge, RosbridgeError


def test_one_message_is_taken_and_no_more_are_asked_for():
    with FakeRosbridge({"/a": [{"data": 1}]}) as server, Rosbridge(server.url) as bridge:
        assert bridge.once("/a", "std_msgs/Int32") == {"data": 1}
        server.wait_for("unsubscribe /a")
    assert server.ops() == ["subscribe /a", "unsubscribe /a"]
    assert server.asked[0]["type"] == "std_msgs/Int32"
    assert server.asked[0]["queue_length"] == 1
    assert server.asked[0]["id"] == server.asked[1]["id"]


def test_only_the_newest_message_is_kept():
    with FakeRosbridge({"/a": [{"data": n} for n in range(5)]}) as server, Rosbridge(server.url) as bridge:
        bridge.subscribe("/a")
        number, message = bridge.receive("/a", after=4)
        assert (number, message) == (5, {"data": 4})
        with pytest.raises(RosbridgeError, match=r"no message on /a within 0\.05 s"):
            bridge.receive("/a", after=number, timeout_s=0.05)


def test_an_old_message_is_none():
    with FakeRosbridge({"/a": []}) as server, Rosbridge(server.url) as bridge:
        bridge.subscribe("/a")
        server.wait_for("subscribe /a")
        server.send("/a", "old")
        bridge.receive("/a")
        with pytest.raises(RosbridgeError, match="no message"):
            bridge.once("/a", timeout_s=0.05)


def test_long_messages_in_fragments_are_joined():
    text = "x" * 170_000
    with FakeRosbridge({"/a": [Broken.IN_PARTS, {"data": text}]}) as server, Rosbridge(server.url) as bridge:
        assert bridge.once("/a")["data"] == text


def test_what_is_published_arrives():
    with FakeRosbridge() as server, Rosbridge(server.url) as bridge:
        bridge.advertise("/goal", "std_msgs/String")
        bridge.publish("/goal", {"data": "go"})
        server.wait_for("publish /goal")
    assert server.ops() == ["advertise /goal", "publish /goal"]
    assert server.asked[1]["msg"] == {"data": "go"}


def test_services_answer_fail_or_are_silent():
    services = {"/enable": {"success": True}, "/broken": "drives are off"}
    with FakeRosbridge(services=services) as server, Rosbridge(server.url) as bridge:
        assert bridge.call("/enable", {"on": True}) == {"success": True}
        assert server.asked[0]["args"] == {"on": True}
        with pytest.raises(RosbridgeError, match="service /broken failed: drives are off"):
            bridge.call("/broken")
        with pytest.raises(RosbridgeError, match="no answer of service /silent"):
            bridge.call("/silent", timeout_s=0.05)


def test_nothing_is_sent_or_awaited_after_a_cut_and_nothing_is_sent_later():
    with FakeRosbridge({"/a": []}, {}) as server:
        bridge = Rosbridge(server.url, timeout_s=3000)
        bridge.subscribe("/a")
        server.wait_for("subscribe /a")
        server.cut()
        # At once, not after the time-out of the test.
        with pytest.raises(RosbridgeError, match=r"connection to rosbridge at .* is lost"):
            bridge.receive("/a")
        for use in (
            lambda: bridge.publish("/goal", {}),
            lambda: bridge.call("/enable"),
            lambda: bridge.once("/a"),
        ):
            with pytest.raises(RosbridgeError, match="is lost"):
                use()
        assert bridge.lost
        bridge.close()
    assert server.ops() == ["subscribe /a"]


@pytest.mark.parametrize(
    ("what", "text"), [(Broken.CUT, "is lost"), (Broken.NONSENSE, "no message of rosbridge")]
)
def test_who_waits_is_told_at_once(what, text):
    with (
        FakeRosbridge({"/a": [what]}) as server,
        Rosbridge(server.url, timeout_s=3000) as bridge,
        pytest.raises(RosbridgeError, match=text),
    ):
        bridge.once("/a")


def test_a_refusal_ends_the_wait_for_that_topic_alone():
    topics = {"/a": [Broken.REFUSED], "/b": [{"data": 1}]}
    with FakeRosbridge(topics) as server, Rosbridge(server.url, timeout_s=3000) as bridge:
        with pytest.raises(RosbridgeError, match="refuses: no such topic"):
            bridge.once("/a")
        assert bridge.once("/b") == {"data": 1}


def test_nobody_there_is_told_with_what_to_do():
    with FakeRosbridge() as server:
        url = server.url
    for wrong in (url, "http://nowhere", "ws://127.0.0.1:1"):
        with pytest.raises(RosbridgeError, match=r"cannot be reached at .*Start it there"):
            Rosbridge(wrong)


def test_a_closed_connection_is_lost():
    with FakeRosbridge() as server:
        with Rosbridge(server.url) as bridge:
            pass
        with pytest.raises(RosbridgeError, match="it was closed"):
            bridge.publish("/a", {})


def test_without_the_library_its_remedy_is_told(monkeypatch):
    for name in ("websockets.sync.client", "websockets.exceptions"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingDependencyError, match="scripts/setup lab"):
        Rosbridge("ws://127.0.0.1:1")
