"""Names and words of models that are made from others. Light to import."""

SUFFIX = ".marked"
"""Suffix of a model with a mark on its front, see `torc.objects.marked`."""


def base_name(name: str) -> str | None:
    """Return the name of the model that a marked one is made from; None for other names."""
    return name.removesuffix(SUFFIX) if name.endswith(SUFFIX) and name != SUFFIX else None


def marked_description(description: str) -> str:
    """Return e.g. "the red tomato soup can with a yellow sticker on its front"."""
    return f"{description} with a yellow sticker on its front"
