"""The suite gives true labels to those that ask for them, and no suite needs pytest."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import torc.testing
from torc.perception.from_masks import FromMasks, Masks
from torc.testing.conformance import NonConformanceError
from torc.testing.perception_conformance import check_perception

SUITES = sorted(p.stem for p in Path(torc.testing.__file__).parent.glob("*.py") if p.stem != "__init__")


class Cheat(FromMasks):
    """Returns the true labels."""

    def perceive(self, observation, wanted, before, label_image):
        self.truth = label_image
        return super().perceive(observation, wanted, before)

    def find(self, observation, wanted):
        return Masks(self.truth, np.full(int(self.truth.max()) + 1, 0.5, np.float32))


class Entitled(Cheat):
    """Says that it needs them, as it has to for a trial."""

    needs_labels = True


def test_true_labels_are_for_a_perception_that_asks_for_them():
    with pytest.raises(NonConformanceError, match="label_image"):
        check_perception(Cheat)
    check_perception(Entitled)


def test_the_suites_need_no_pytest():
    lines = "import sys; sys.modules['pytest'] = None\n" + "".join(
        f"import torc.testing.{s}\n" for s in SUITES
    )
    subprocess.run([sys.executable, "-c", lines], check=True)


def test_misspelt_and_wrongly_typed_traits_are_found():
    class Misspelt(Entitled):
        need_pictures = True

    class Wrong(Entitled):
        reads_words = "yes"

    with pytest.raises(NonConformanceError, match=r"`need_pictures`.*did you mean `needs_pictures`"):
        check_perception(Misspelt)
    with pytest.raises(NonConformanceError, match=r"`reads_words` is a str; it must be True or False"):
        check_perception(Wrong)
