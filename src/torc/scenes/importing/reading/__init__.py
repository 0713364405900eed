"""Mesh files to surfaces, all formats. Runs in a child process: the files are a stranger's.

GLB and PLY are read here: what the well-kept libraries for them cannot read of a file they leave out without a word.
OBJ and STL are read by trimesh.
"""

from torc.scenes.importing.reading.limits import MAX_MESH_BYTES
from torc.scenes.importing.reading.reader import Y_UP, read_surfaces

__all__ = ["MAX_MESH_BYTES", "Y_UP", "read_surfaces"]
