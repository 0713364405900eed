"""What is known of the objects there are. One that is damaged is told of and stops nothing."""

import sys
from typing import TYPE_CHECKING

from torc.cli.printing import printable

if TYPE_CHECKING:
    from torc.errors import InputError
    from torc.objects.library import ObjectFacts


def known_objects() -> list["ObjectFacts"]:
    """Facts of all objects whose description can be read, those that come with torc first."""
    from torc.errors import InputError
    from torc.objects.library import object_facts, object_names

    found = []
    for name in object_names():
        try:
            found.append(object_facts(name))
        except InputError as error:
            pass_over(error)
    return found


def pass_over(error: "InputError") -> None:
    """Says why an object is left out; goes to the error stream, as tables and JSON go to the other one."""
    print(printable(f"torc: {error}"), file=sys.stderr, flush=True)
