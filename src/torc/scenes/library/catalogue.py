"""What the library holds: kinds and their variants, as plain data. Light: no numpy, and nothing is built."""

from torc.scenes.library.catalogue_food import KINDS as FOOD
from torc.scenes.library.catalogue_household import KINDS as HOUSEHOLD
from torc.scenes.library.catalogue_kitchen import KINDS as KITCHEN
from torc.scenes.library.catalogue_packages import KINDS as PACKAGES
from torc.scenes.library.catalogue_play import KINDS as PLAY
from torc.scenes.library.catalogue_things import KINDS as THINGS
from torc.scenes.library.kinds import Kind

ALL_KINDS: tuple[Kind, ...] = (*PACKAGES, *FOOD, *HOUSEHOLD, *THINGS, *KITCHEN, *PLAY)
"""Every kind of the library."""
