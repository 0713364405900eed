"""Benchmarks play in processes of their own."""

from benchmarks.processes import run_jobs


def test_jobs_run_in_processes_of_their_own(capfd):
    run_jobs("{}-{}".format, [("a", 1), ("b", 2)], workers=2)
    lines = capfd.readouterr().out.splitlines()
    assert sorted(line.split()[1] for line in lines) == ["a-1", "b-2"]
    assert [line.split()[0] for line in lines] == ["[1/2]", "[2/2]"]
