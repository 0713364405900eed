"""Objects: what the simulator needs to know of a thing, its files, the library, the import of meshes."""
