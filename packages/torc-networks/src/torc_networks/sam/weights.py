"""Weights that are known to fit, with their licences. None come with torc, and nothing is fetched at import."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Weights:
    """A set of weights on the Hugging Face hub.

    Attributes:
        name: its id there.
        licence: as its model card names it.
        millions: parameters, 1e6; those of a single picture's network for SAM 2.1.
        gated: downloads need an account that was let in.
    """

    name: str
    licence: str
    millions: float
    gated: bool = False


GROUNDING_DINO_TINY = Weights("IDEA-Research/grounding-dino-tiny", "Apache-2.0", 172)
GROUNDING_DINO_BASE = Weights("IDEA-Research/grounding-dino-base", "Apache-2.0", 232)
SAM2_TINY = Weights("facebook/sam2.1-hiera-tiny", "Apache-2.0", 31)
SAM2_SMALL = Weights("facebook/sam2.1-hiera-small", "Apache-2.0", 39)
SAM2_BASE_PLUS = Weights("facebook/sam2.1-hiera-base-plus", "Apache-2.0", 73)
SAM2_LARGE = Weights("facebook/sam2.1-hiera-large", "Apache-2.0", 217)
SAM3 = Weights("facebook/sam3", "SAM License", 840, gated=True)

KNOWN: tuple[Weights, ...] = (
    GROUNDING_DINO_TINY,
    GROUNDING_DINO_BASE,
    SAM2_TINY,
    SAM2_SMALL,
    SAM2_BASE_PLUS,
    SAM2_LARGE,
    SAM3,
)


def known_weights(name: str) -> Weights | None:
    """What is known of weights with that id; None for a folder, or somebody else's."""
    return next((w for w in KNOWN if w.name == name), None)
