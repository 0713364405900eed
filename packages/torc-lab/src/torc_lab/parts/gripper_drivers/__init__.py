"""Drivers of grippers, for a lab file."""
