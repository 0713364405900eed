"""Base class of what holds resources that must be freed."""

from abc import ABC, abstractmethod
from typing import Self


class Closing(ABC):
    """Close it, or use it in a `with` statement."""

    @abstractmethod
    def close(self) -> None:
        """Free what it holds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
