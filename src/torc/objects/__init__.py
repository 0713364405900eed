"""Object models as the simulator needs them: their files, the library, the import of meshes."""
