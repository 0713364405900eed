"""A Ray cluster of three nodes on this machine: the same table as without it, whatever happens to a node."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.helpers.fake_bench import InlineBackend, fake_spec, play_quickly
from torc.benchmark.playing import run_missing
from torc.benchmark.ray_pool import load_ray
from torc.benchmark.reading import read_table
from torc.benchmark.rows import trial_records
from torc.benchmark.store import WORK, Store

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(1800),
    # Ray's own, about its future.
    pytest.mark.filterwarnings("ignore"),
]
CHECKOUT = Path(__file__).parents[2]
NODE = {"num_cpus": 1, "object_store_memory": 100_000_000}


@pytest.fixture(scope="module")
def cluster():
    """Three nodes of one CPU; tests that take one away put it back."""
    load_ray()
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={**NODE, "include_dashboard": False})
    try:
        for _ in range(2):
            cluster.add_node(**NODE)
        yield cluster
    finally:
        cluster.shutdown()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The table of a benchmark that nothing came in the way of."""
    store, spec = Store(tmp_path_factory.mktemp("whole")), fake_spec()
    with store.locked():
        store.extend(spec, {})
        run_missing(store, spec, InlineBackend(), work=play_quickly)
    return _table(store.root)


def _table(root):
    return trial_records(read_table(root))


def _runner(root, cluster):
    command = [sys.executable, "-m", "tests.helpers.fake_bench", str(root), "--ray", cluster.address]
    return subprocess.Popen(
        command,
        cwd=CHECKOUT,
        stdout=subprocess.PIPE,
        text=True,
        # Tests that run in the background are deaf to Ctrl-C, and so would be what they start.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


def _half_way(runner, root):
    while len(list(root.glob("trials/*/result.json"))) < 4:
        assert runner.poll() is None
        time.sleep(0.1)


def test_a_node_that_is_killed_costs_nothing_but_time(cluster, tmp_path, whole):
    runner = _runner(tmp_path, cluster)
    _half_way(runner, tmp_path)
    # The command ends with the node that it runs on, which says its id first.
    own = runner.stdout.readline().strip()
    lost = next(n for n in cluster.worker_nodes if n.node_id != own)
    (raylet,) = lost.all_processes["raylet"]
    raylet.process.kill()
    raylet.process.wait()
    cluster.remove_node(lost, allow_graceful=False)  # the rest of it
    try:
        assert runner.wait() == 0
    finally:
        cluster.add_node(**NODE)
    assert _table(tmp_path) == whole


def test_after_ctrl_c_it_goes_on(cluster, tmp_path, whole):
    runner = _runner(tmp_path, cluster)
    _half_way(runner, tmp_path)
    runner.send_signal(signal.SIGINT)
    assert runner.wait() != 0
    assert not (tmp_path / WORK).exists()
    assert len(list(tmp_path.glob("trials/*"))) < len(whole)
    assert _runner(tmp_path, cluster).wait() == 0
    assert _table(tmp_path) == whole
