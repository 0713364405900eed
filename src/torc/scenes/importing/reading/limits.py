"""What a mesh file may hold."""

MAX_MESH_BYTES = 200 * 2**20
MAX_FILE_FACES = 3_000_000
MAX_FILE_VERTICES = 3 * MAX_FILE_FACES
MAX_FILE_NUMBERS = 16 * MAX_FILE_VERTICES
"""Places, texture coordinates, colours and indices, as often as they are unpacked; three more per morph target."""
MAX_PARTS = 2_000
