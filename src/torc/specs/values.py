"""Values of settings as text."""

from typing import Any

import yaml


def plain_value(text: str) -> Any:
    """What a text means as YAML: a number, true, null, a list in brackets; else the text itself."""
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return text
