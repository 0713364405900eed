"""The prompts: files of this package. A changed prompt is a new file with the next number; results name theirs."""

from importlib.resources import files
from string import Template


def fill_prompt(name: str, **values: object) -> str:
    """The prompt of that name with its $placeholders filled. Raises KeyError for one that is left open."""
    text = (files("torc.vlm") / "prompts" / f"{name}.txt").read_text(encoding="utf-8")
    return Template(text).substitute(values).strip()
