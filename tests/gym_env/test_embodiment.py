"""The embodiment of inspect-robots, run by it. Needs scripts/harnesses."""

import pytest

from tests.helpers.harness_environments import run_in_harness


@pytest.mark.long
def test_inspect_robots_plays_a_retrieval(tmp_path):
    arguments = ["-m", "tests.helpers.run_inspect_robots", "validation-structured-01", str(tmp_path / "logs")]
    found = run_in_harness("inspect-robots", arguments, tmp_path)
    assert found["conformant"]
    assert found["registered"]
    assert found["status"] == "success"
    assert "errored_trials=0" in found["results"]
    assert f"'episode_length': {float(len(found['seen']))}" in found["results"]
    assert [shape for shape, _ in found["seen"]] == [[480, 640, 3]] * len(found["seen"])
    last = [number for _, number in found["seen"]]
    assert last[0] == -1
    # What was taken cannot be taken again.
    assert len(set(last)) == len(last)
