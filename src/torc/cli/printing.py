"""Text for terminals."""


def printable(text: str) -> str:
    """The text with an escape for every control character but the end of a line.

    Names in strangers' files could otherwise move the cursor, change colours or clear the screen.
    """
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
