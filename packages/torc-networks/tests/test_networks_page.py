"""docs/networks.md and servers/ fit the stages: actions, ports, options."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from torc.registry.kinds import STAGES
from torc.registry.loading import part_paths
from torc_networks.depth import NetworkDepthConfig
from torc_networks.grasping.planners import ContactGraspNetConfig, GraspGenXConfig
from torc_networks.motion.planner import CuroboConfig
from torc_networks.perception import NetworkPerceptionConfig
from torc_networks.serving.handlers import ACTIONS

ROOT = Path(__file__).parents[3]
SERVERS_FOLDER = Path(__file__).parents[1] / "servers"
PAGE = (ROOT / "docs" / "networks.md").read_text()
SERVERS = sorted(SERVERS_FOLDER.glob("*.py"))
PORTS = {
    "--perception network": (NetworkPerceptionConfig, {"sam"}),
    "--depth network": (NetworkDepthConfig, {"foundation_stereo", "fast_foundation_stereo"}),
    "--grasps graspgenx": (GraspGenXConfig, {"graspgenx"}),
    "--grasps contact-graspnet": (ContactGraspNetConfig, {"contact_graspnet"}),
    "--motion curobo": (CuroboConfig, {"curobo"}),
}


def test_there_is_a_server_for_every_stage():
    assert {p.stem for p in SERVERS} == set().union(*(names for _, names in PORTS.values()))


@pytest.mark.parametrize("path", SERVERS, ids=lambda p: p.stem)
def test_servers_can_be_read_and_say_what_was_run(path):
    tree = ast.parse(path.read_text())
    text = ast.get_docstring(tree) or ""
    assert text.splitlines()[0] == "Written against the documented interface; not yet run."
    assert "Licence" in text
    assert "Install" in text
    imported = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert "torc_networks.server" in imported


@pytest.mark.parametrize("option", PORTS)
def test_a_stage_asks_where_its_servers_listen(option):
    config, names = PORTS[option]
    port = config().server.address.rsplit(":", 1)[1]
    assert re.search(rf"\| `{option}` \|.*\| {port} \|", PAGE)
    for name in names:
        assert f'"--port", type=int, default={port}' in (SERVERS_FOLDER / f"{name}.py").read_text()
    stage, part = option.removeprefix("--").split()
    assert part in part_paths(STAGES[stage])


def test_every_action_is_on_the_page():
    assert {a for a in ACTIONS if f"| `{a}` |" not in PAGE} == set()


def test_the_server_on_the_page_serves():
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict = {"__name__": "page"}
    exec(code, names)
    grey = np.zeros((4, 5), np.uint8)
    assert names["stereo"]({"left": grey, "right": grey})["disparity"].shape == (4, 5)
