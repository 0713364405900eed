"""Drivers of arms, for a lab file."""
