"""Objects out of mesh files: OBJ, GLB, STL, PLY. Needs the extra `import` (trimesh, CoACD and others).

Mesh files come from strangers, so each is made into an object in a child process with limits of time and memory; what
comes back is validated like any object file.
"""

from torc.objects.importing.mesh import FORMATS, MeshImport, MeshOptions, read_mesh

__all__ = ["FORMATS", "MeshImport", "MeshOptions", "read_mesh"]
