"""Objects out of mesh files: OBJ, GLB, STL, PLY. Needs the extra `import` (CoACD and others).

Mesh files come from strangers, so they are parsed and decomposed in child processes with limits of time and memory;
what comes back is validated like any object file.
"""

from torc.scenes.importing.mesh import MeshImport, import_mesh, read_mesh
from torc.scenes.importing.options import FORMATS, MeshOptions

__all__ = ["FORMATS", "MeshImport", "MeshOptions", "import_mesh", "read_mesh"]
