"""What a check of a laboratory says."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """Something about a device, and whether it is as it should be."""

    device: str
    good: bool
    text: str
