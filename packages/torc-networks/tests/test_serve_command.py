"""`torc serve`: what it serves, to whom, and how it ends."""

import signal
import subprocess
import sys
from contextlib import closing

import numpy as np
import pytest

from network_helpers.network_servers import config_for
from torc.cli.main import main, parse
from torc.errors import UnknownNameError
from torc_networks.client import NetworkClient
from torc_networks.fields import read_disparity
from torc_networks.serving.command import ServeCommand
from torc_networks.serving.handlers import ACTIONS, own_handlers


def test_every_part_answers_or_says_what_it_misses(robot, workspace):
    handlers = own_handlers(robot, workspace)
    assert tuple(handlers) == ACTIONS
    for name, handler in handlers.items():
        with pytest.raises(Exception, match="This request cannot be answered") as told:
            handler({})
        assert type(told.value).__name__ == "InputError", name


def test_parts_that_there_are_not_are_refused(robot, workspace):
    with pytest.raises(UnknownNameError, match="segment"):
        own_handlers(robot, workspace, ("segmant",))


def test_the_options_of_the_command():
    assert parse(["serve"]) == ServeCommand()
    command = parse(["serve", "--actions", "stereo", "--port", "7", "--host", "0.0.0.0", "--remote"])
    assert command == ServeCommand("stereo", 7, "0.0.0.0", True)


def test_another_host_takes_a_word_of_its_own(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["serve", "--actions", "stereo", "--host", "0.0.0.0", "--port", "0"])
    assert ended.value.code == 2
    assert "--remote" in capsys.readouterr().err


@pytest.mark.long
def test_the_command_serves_until_ctrl_c():
    command = [sys.executable, "-u", "-m", "torc.cli.main", "serve", "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    line = server.stdout.readline()
    assert line.startswith(
        "torc with sda10f_2f85 answers grasps, infer, plan, segment, stereo at tcp://127.0.0.1:"
    )
    with closing(NetworkClient(config_for(line.split()[-1], 120.0))) as client:
        grey = np.random.default_rng(0).integers(0, 255, (40, 80), np.uint8)
        answer = client.ask("stereo", left=grey, right=grey, max_disparity=16)
        assert read_disparity(answer)[0].shape == (40, 80)
        assert client.ask("metadata").values["actions"] == sorted(ACTIONS)
    server.send_signal(signal.SIGINT)
    server.communicate(timeout=120)
    assert server.returncode == 0
