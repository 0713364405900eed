"""Hand-written rules in place of the networks of embedded."""

from torc.perception.embedded.regions import RegionPerception as PART
