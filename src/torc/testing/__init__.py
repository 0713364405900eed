"""Conformance suites for parts of one's own and the synthetic scenes that they use."""
