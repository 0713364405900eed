"""The options of a VLM become its configuration, or say what is wrong."""

import shlex

import pytest

from torc.cli.main import parse
from torc.errors import InputError
from torc.vlm.picture_config import PictureConfig
from torc.vlm.prices import Prices


def config(text):
    return parse(["run", "--vlm", "gemini:m", *shlex.split(text)]).vlm.config()


def test_pictures_prompt_and_prices(tmp_path):
    (tmp_path / "mine.txt").write_text("Which, for $target?")
    found = config(
        f"--vlm-marks outlines --vlm-plain --vlm-crop 24 --vlm-longest-side 1024 --vlm-prompt {tmp_path}/mine.txt "
        "--vlm-prices 0.3,2.5"
    )
    assert found.picture == PictureConfig("outlines", True, 24, 1024)
    assert (found.prompt.name, found.prompt.user) == ("mine", "Which, for $target?")
    assert found.prices == Prices(0.3, 2.5)
    assert config("").words == ()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ("--vlm-crop -3", "at least 0"),
        ("--vlm-longest-side 9", "64 to 4096"),
        ("--vlm-prompt none.yaml", "cannot be read"),
        ("--vlm-prompt vlm-selct-2", "Did you mean 'vlm-select-2'"),
        ("--vlm-prices cheap", "SENT|million tokens"),
    ],
)
def test_what_cannot_be_says_why(options, told):
    with pytest.raises(InputError, match=told):
        config(options)
