"""Conformance suites for drivers, and an operator who always says yes."""
