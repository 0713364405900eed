"""Results replace results of their kind, and nothing else."""

import pytest

from torc.errors import InputError
from torc.records.directories import check_place


def _check(out, overwrite=True):
    check_place(out, overwrite, "log.txt", "trial")


def test_new_and_empty_directories_and_those_of_the_kind_may_be_taken(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "kind").mkdir()
    (tmp_path / "kind" / "log.txt").write_text("")
    for name in ("new", "empty", "kind"):
        _check(tmp_path / name)
    _check(tmp_path / "new", overwrite=False)
    with pytest.raises(InputError, match="add --overwrite to replace it"):
        _check(tmp_path / "kind", overwrite=False)


@pytest.mark.parametrize("overwrite", [True, False])
def test_nothing_else_is_replaced_whatever_is_asked_for(tmp_path, overwrite):
    kind = tmp_path / "kind"
    kind.mkdir()
    (kind / "log.txt").write_text("")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.txt").write_text("")
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(kind)
    (tmp_path / "dead").symlink_to(tmp_path / "nowhere")
    for name in ("thesis", "file", "link", "dead"):
        with pytest.raises(InputError, match="is no trial, so nothing replaces it"):
            _check(tmp_path / name, overwrite)


@pytest.mark.parametrize("name", [".", "..", "", "/", "kind/.."])
def test_a_directory_needs_a_name(tmp_path, name, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="give it a name"):
        _check(type(tmp_path)(name))
