"""The workspace: table, bin, camera and watched region, and their files."""
