"""Clients of the vendors' servers."""
