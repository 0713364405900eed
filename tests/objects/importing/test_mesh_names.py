"""Names of meshes whose files are named in another script than Latin."""

from pathlib import Path

import pytest

from torc.objects.importing.mesh import MeshOptions


def test_every_file_gets_a_name_of_its_own():
    files = ["茶.stl", "瓶子.stl", "杯子.obj", "Кружка.obj", "كوب.ply", "!!!.glb"]
    names = [MeshOptions().name_for(Path(f)) for f in files]
    assert len(set(names)) == len(files)
    assert all(name.startswith("object_") and name.isascii() for name in names)
    assert [MeshOptions().name_for(Path(f)) for f in files] == names
    assert MeshOptions().description_for(Path("瓶子.stl")) == "the 瓶子"


@pytest.mark.parametrize(
    ("file", "name"), [("Tea cup.obj", "tea_cup"), ("Tasse für Tee.stl", "tasse_f_r_tee")]
)
def test_latin_names_stay_as_they_were(file, name):
    assert MeshOptions().name_for(Path(file)) == name
