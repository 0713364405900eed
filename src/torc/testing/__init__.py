"""Conformance suites for parts of one's own; and what they are made of: synthetic scenes, fake VLM servers."""
