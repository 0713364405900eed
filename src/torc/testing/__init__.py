"""Conformance suites for user-defined parts, and the synthetic scenes that they use."""
