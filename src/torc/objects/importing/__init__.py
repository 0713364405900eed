"""Import objects from mesh files: OBJ, GLB, STL, PLY. Needs the extra `import` (trimesh, CoACD and others).

Mesh files come from strangers, so each is converted in a child process with limits of time and memory; the result is
validated like any object file.
"""

from torc.objects.importing.mesh import FORMATS, MeshImport, MeshOptions, read_mesh

__all__ = ["FORMATS", "MeshImport", "MeshOptions", "read_mesh"]
