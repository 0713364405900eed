"""Cameras; `--camera`."""
