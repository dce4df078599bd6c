"""Text of strangers, made short enough for a log and an error."""

LONGEST_TEXT = 4000
"""Characters of an error's or an incident's sentence; what is longer loses its middle."""


def shorten(text: str, most: int = LONGEST_TEXT) -> str:
    """
    Return a text; if it is too long, its two ends, and how long it is.

    :param most: the characters of it that are kept; saying how long it is takes some more.
    """
    if len(text) <= most:
        return text
    end = most // 2
    return f'{text[:end]}... ({len(text)} characters) ...{text[len(text) - end:]}'
