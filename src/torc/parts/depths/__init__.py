"""Depth stages; `--depth`."""
