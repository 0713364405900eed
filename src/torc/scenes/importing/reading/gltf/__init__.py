"""glTF 2.0 files in their binary form, GLB."""
