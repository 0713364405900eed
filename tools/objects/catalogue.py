"""What the library holds: kinds and their variants, as plain data. Light: no numpy, and nothing is built."""

from tools.objects.catalogue_food import KINDS as FOOD
from tools.objects.catalogue_household import KINDS as HOUSEHOLD
from tools.objects.catalogue_kitchen import KINDS as KITCHEN
from tools.objects.catalogue_packages import KINDS as PACKAGES
from tools.objects.catalogue_play import KINDS as PLAY
from tools.objects.catalogue_things import KINDS as THINGS
from tools.objects.kinds import Kind

ALL_KINDS: tuple[Kind, ...] = (*PACKAGES, *FOOD, *HOUSEHOLD, *THINGS, *KITCHEN, *PLAY)
"""Every kind of the library."""
