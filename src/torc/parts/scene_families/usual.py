"""None of the harder families: the rules of torc40."""

from torc.generation.families import SceneFamily as PART
