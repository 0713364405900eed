"""The example client keeps to the rules; the model behind it is a stand-in."""

import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import ClassVar

import pytest

from http_vlm import HttpVlm
from torc import InputError, VlmConfig
from torc.pipeline.planners import open_client
from torc.protocols import FailureKind, VlmError
from torc.testing.vlm_client_conformance import CASES, check_case
from torc.vlm.config import parse_vlm

PLAN = json.dumps({"thoughts": "1 is in front.", "plan": [{"action": "remove", "input": 1}]})


class Model(BaseHTTPRequestHandler):
    """Always begins with object 1; paths choose what goes wrong."""

    asked: ClassVar[dict] = {}

    def do_POST(self):
        Model.asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(500 if self.path == "/broken" else 200)
        self.end_headers()
        self.wfile.write(b"{}" if self.path == "/odd" else json.dumps({"text": PLAN}).encode())

    def log_message(self, *args):
        pass


@pytest.fixture(scope="module")
def address():
    with HTTPServer(("127.0.0.1", 0), Model) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def _client(address, path="/ask"):
    return open_client(VlmConfig(*parse_vlm(f"http_vlm:HttpVlm:my-model@{address}{path}")))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_conforms(case, address):
    check_case(lambda: _client(address), case)
    assert Model.asked["prompt"] == case.build().prompt
    assert Model.asked["seed"] == case.build().repeat


@pytest.mark.parametrize(
    ("path", "kind"), [("/broken", FailureKind.SERVER), ("/odd", FailureKind.BAD_RESPONSE)]
)
def test_without_a_reply_it_says_why(path, kind, address):
    with pytest.raises(VlmError) as caught:
        _client(address, path).ask(CASES[0].build())
    assert caught.value.kind is kind


def test_a_server_that_is_not_there_and_no_address_at_all():
    with pytest.raises(VlmError, match="no connection"):
        _client("http://127.0.0.1:9").ask(CASES[0].build())
    with pytest.raises(InputError, match="Say where the model is"):
        HttpVlm(VlmConfig("http_vlm:HttpVlm", ""))
