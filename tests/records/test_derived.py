"""What is derived from a record is kept as long as the record, and no longer."""

import gc
from dataclasses import dataclass

from torc.records import derived
from torc.records.derived import once


@dataclass(frozen=True)
class Thing:
    number: int


def test_it_is_derived_once_per_record_and_key():
    calls = []
    first, second = Thing(1), Thing(1)
    for record, key in ((first, "a"), (first, "a"), (first, "b"), (second, "a")):
        assert once(record, key, lambda r=record, k=key: calls.append((id(r), k)) or (r, k)) == (record, key)
    assert calls == [(id(first), "a"), (id(first), "b"), (id(second), "a")]


def test_nothing_is_kept_of_a_record_that_is_gone():
    record = Thing(2)
    place = id(record)
    once(record, "a", lambda: 1)
    assert place in derived._KEPT
    del record
    gc.collect()
    assert place not in derived._KEPT
