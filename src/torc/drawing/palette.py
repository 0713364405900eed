"""Sixty-four fixed colours, one per object id."""

from torc.errors import InputError
from torc.records import MAX_OBJECTS

# Red is the target's; the others avoid red. Chosen greedily, each as far as possible (CIELAB, the smallest distance
# in normal sight, deuteranopia and protanopia) from all before it and from a grey table: low ids differ most.
_COLORS = """
e11923 6900ff 00ffc3 f0f000 7896ff b40078 69e1ff ffc369 69a569 693cc3 d287b4 1e78b4 b4a500 00780f 964b5a 4bf0e1
b43cff e100b4 d2e196 f0a596 78b4f0 96a54b ffe15a ff2d96 d24be1 b4d200 96694b 2d9696 f078d2 5ad24b 963c96 692de1
2d78d2 b44b78 ff96b4 96783c 96ff87 d2b478 b4962d 1e9669 00b4d2 1e691e 87ffb4 5ad2d2 4b5ae1 874b3c 784b78 3cc369
69871e 1ed296 ff3cff 00f069 00d2b4 f0b4f0 87c32d 0f87b4 961eff 87f04b a578d2 87f0d2 ff00b4 1ea596 c37878 e196f0
"""


def object_color(object_id: int) -> tuple[int, int, int]:
    """Return the RGB colour of an object id, 0..255 each. Raises InputError for an id outside 0..63."""
    if not 0 <= object_id < MAX_OBJECTS:
        raise InputError(f"Object id {object_id} has no colour; ids are 0..{MAX_OBJECTS - 1}.")
    code = _COLORS.split()[object_id]
    return int(code[:2], 16), int(code[2:4], 16), int(code[4:], 16)
