"""Shortening text: other nodes choose frame names, and a name may be of any length."""

LONGEST_TEXT = 4000
"""Characters of a sentence in an error or an incident; a longer one loses its middle."""


def shorten(text: str, most: int = LONGEST_TEXT) -> str:
    """
    Return a text; if it is too long, its two ends and its length.

    :param most: how many of its characters are kept; the length is written besides.
    """
    if len(text) <= most:
        return text
    end = most // 2
    return f'{text[:end]}... ({len(text)} characters) ...{text[len(text) - end:]}'
