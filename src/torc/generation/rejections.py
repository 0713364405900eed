"""Why a scene holds no problem of the wanted kind."""

from enum import StrEnum


class Reason(StrEnum):
    """The step at which an attempt ended, in the order of the steps."""

    DOES_NOT_FIT = "the objects do not fit side by side"
    PHYSICS = "the simulation broke"
    TOO_FEW_LEFT = "too few objects stayed within reach"
    NOT_AT_REST = "it did not come to rest"
    WEDGED = "objects are pressed into each other"
    NONE_SO_HIDDEN = "no object is hidden as wanted"
    CANNOT_BE_GRASPED = "such an object, or one around it, cannot be grasped at all"
    TRIVIAL = "each such object can be grasped at once"
    MOVED_LATER = "something moved within 10 s"


class RejectedError(Exception):
    """A scene holds no problem of the wanted kind."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(reason.value)
        self.reason = reason
