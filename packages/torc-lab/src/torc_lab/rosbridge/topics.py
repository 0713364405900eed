"""What is published, for messages that say why nothing came."""

from collections.abc import Collection

from torc_lab.rosbridge.client import Rosbridge, RosbridgeError

_ANSWERS_S = 1.0
"""rosapi names the topics within this time, or nobody runs it."""
_LISTED = 12


def published(bridge: Rosbridge, kinds: Collection[str]) -> str:
    """A sentence that names the topics of these types, e.g. sensor_msgs/Image; "" where nobody can say: it takes the
    node rosapi beside rosbridge.
    """
    try:
        answer = bridge.call("/rosapi/topics", timeout_s=_ANSWERS_S)
        there = sorted(zip(answer["topics"], answer["types"], strict=True))
    except (RosbridgeError, LookupError, TypeError, ValueError):
        return ""
    found = [f"{name} ({kind})" for name, kind in there if kind in kinds]
    if not found:
        return f" Nothing of the type {' or '.join(kinds)} is published."
    return f" Published are: {', '.join(found[:_LISTED])}."
