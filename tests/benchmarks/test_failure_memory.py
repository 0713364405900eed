"""The fit of what a failure says about an object."""

from scipy.special import expit, logit

from benchmarks import failure_memory as memory


def test_the_fit_finds_what_the_failures_took(rng):
    n = 6000
    p, failures = rng.uniform(0.3, 0.99, n), rng.integers(0, 4, n).astype(float)
    delivered = (rng.random(n) < expit(logit(p) - 0.7 * failures)).astype(float)
    problems = [f"problem-{k}" for k in rng.integers(0, 30, n)]
    found = memory.fit(p, failures, delivered, problems)
    assert found.low < 0.7 < found.high
    assert found.high - found.low < 0.2


def test_the_table_counts_by_failures_before():
    rows = [{"p": 0.9, "failures": 0, "delivered": True}, {"p": 0.5, "failures": 7, "delivered": False}]
    assert "| 0 | 1 | 0.90 | 1.00 |" in memory.table(rows)
    assert "| 5 or more | 1 | 0.50 | 0.00 |" in memory.table(rows)
