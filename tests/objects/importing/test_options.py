"""An object's name says which file it is from, however deep the file lies."""

import re
from pathlib import Path

import pytest

from torc.errors import InputError
from torc.objects.importing.options import MeshOptions
from torc.objects.schema import NAME_PATTERN

DEEP = "dataset_release_2_household_objects_kitchen_and_dining_tableware_"


@pytest.mark.parametrize(
    ("stem", "name"),
    [("My Box", "my_box"), ("_.cup-", "cup"), ("x" * 64, "x" * 64), ("a" + "-" * 62 + "mug", "mug")],
)
def test_names_are_made_of_file_names(stem: str, name: str) -> None:
    assert MeshOptions().name_for(Path(f"{stem}.obj")) == name


def test_long_names_keep_the_end_which_tells_files_apart() -> None:
    names = [MeshOptions().name_for(Path(f"{DEEP}{end}.obj")) for end in ("mug_red", "mug_blue", "mug")]
    assert len(set(names)) == 3
    for name, end in zip(names, ("tableware_mug_red", "tableware_mug_blue", "tableware_mug")):
        assert name.endswith(end)
        assert re.fullmatch(NAME_PATTERN, name)


def test_names_of_nothing_are_refused() -> None:
    with pytest.raises(InputError, match="Give one with --name"):
        MeshOptions().name_for(Path("---.obj"))
