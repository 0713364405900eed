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
