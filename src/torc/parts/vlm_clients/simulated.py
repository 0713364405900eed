"""The simulator's truth with mistakes: simulated:PROFILE."""

from torc.vlm.simulated.client import open_simulated as PART
