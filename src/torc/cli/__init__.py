"""The `torc` command."""
