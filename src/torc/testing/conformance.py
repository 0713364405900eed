"""What the conformance suites have in common."""

from torc.errors import TorcError


class NonConformanceError(TorcError, AssertionError):
    """A part broke its protocol's rules; the text lists case and rule."""
