"""Mesh files to surfaces, all formats. Runs in a child process: the files are a stranger's.

Each format has a reader of its own: libraries leave out what they cannot read of a file without a word, or read it
wrongly (concave polygons, relative indices, sparse accessors, colours of vertices).
"""

from torc.scenes.importing.reading.limits import MAX_MESH_BYTES
from torc.scenes.importing.reading.reader import Y_UP, read_surfaces

__all__ = ["MAX_MESH_BYTES", "Y_UP", "read_surfaces"]
