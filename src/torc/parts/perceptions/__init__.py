"""Perceptions; `--perception`."""
