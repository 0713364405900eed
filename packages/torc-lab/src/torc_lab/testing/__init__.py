"""Conformance suites for drivers."""
