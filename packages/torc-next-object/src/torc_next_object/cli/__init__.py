"""The commands `torc next-object` and `torc vlm-eval`."""
