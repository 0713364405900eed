"""A directory travels bit for bit, and never out of the directory that it is unpacked to."""

import os

import pytest

from tests.helpers.fake_bench import fake_spec, play_quickly
from torc.benchmark.playing import TRIAL, Order
from torc.benchmark.remote.parcel import Parcel, pack, unpack
from torc.errors import InputError


def tree(root):
    """Everything below a directory."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes() if path.is_file() else None
        for path in root.rglob("*")
    }


def test_a_trial_travels_bit_for_bit(tmp_path):
    (trial, *_) = fake_spec().trials
    play_quickly(Order(trial, trial.problem.name, tmp_path / "there"))
    (tmp_path / "there" / "nothing" / "at all").mkdir(parents=True)
    (tmp_path / "there" / "empty.txt").touch()
    (tmp_path / "there" / "größe\n.bin").write_bytes(os.urandom(3000))
    parcel = pack(tmp_path / "there")
    unpack(parcel, tmp_path / "here")
    found = tree(tmp_path / "here")
    assert found == tree(tmp_path / "there")
    assert f"{TRIAL}/picks/00_seen.png" in found
    assert parcel.size == sum(len(content or b"") for content in found.values())


def test_of_a_log_only_the_end_travels(tmp_path):
    (tmp_path / "a").mkdir()
    for name in ("log", "a/log"):
        (tmp_path / name).write_bytes(b"0123456789")
    assert dict(pack(tmp_path, ends={"log": 4}).files) == {"log": b"6789", "a/log": b"0123456789"}


def test_links_are_not_followed(tmp_path):
    (tmp_path / "secrets").mkdir()
    (tmp_path / "secrets" / "key").write_text("secret")
    root = tmp_path / "trial"
    root.mkdir()
    (root / "file").symlink_to(tmp_path / "secrets" / "key")
    (root / "directory").symlink_to(tmp_path / "secrets")
    assert pack(root) == Parcel()


ESCAPES = [
    "../x",
    "a/../../x",
    "/x",
    "C:x",
    "C:\\x",
    "..\\x",
    "\\x",
    "",
    ".",
    "..",
    "a//x",
    "./x",
    "a/",
    "x\0",
]


@pytest.mark.parametrize("name", ESCAPES)
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_path_that_leads_out_is_refused(tmp_path, name, kind):
    parcel = (
        Parcel((("good", b""), (name, b"bad")))
        if kind == "file"
        else Parcel((("good", b""),), folders=(name,))
    )
    with pytest.raises(InputError, match="out of its directory"):
        unpack(parcel, tmp_path / "below" / "here")
    assert tree(tmp_path) == {}


def test_names_that_meet_are_refused(tmp_path):
    with pytest.raises(InputError, match="same name"):
        unpack(Parcel((("a", b""), ("a", b""))), tmp_path / "here")


def test_nothing_is_written_into_a_directory_that_is_there(tmp_path):
    with pytest.raises(FileExistsError):
        unpack(Parcel((("a", b""),)), tmp_path)
    assert tree(tmp_path) == {}
