"""A share of a benchmark for each of several machines that know nothing of each other, e.g. of a batch system."""

import re
from dataclasses import dataclass, replace

from torc.benchmark.spec import BenchSpec
from torc.errors import InputError


@dataclass(frozen=True)
class Shard:
    """Every `count`-th trial, beginning with number `index`, which counts from 1."""

    index: int
    count: int

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"

    def of(self, spec: BenchSpec) -> BenchSpec:
        """The trials of this shard. Raises InputError if there are none."""
        trials = spec.trials[self.index - 1 :: self.count]
        if not trials:
            raise InputError(
                f"--shard {self} holds none of the {len(spec.trials)} trials: take fewer shards."
            )
        return replace(spec, trials=trials)


def parse_shard(text: str) -> Shard:
    """From "3/20". Raises InputError."""
    found = re.fullmatch(r"(\d+)/(\d+)", text)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--shard takes I/N with I from 1 to N, e.g. 3/20, not '{text}'.")
    return Shard(int(found[1]), int(found[2]))
