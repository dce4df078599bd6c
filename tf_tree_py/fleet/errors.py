"""What is wrong with a fleet's connection as a whole; what a robot sends wrong is counted."""


class FleetError(Exception):
    """
    A fleet that cannot be heard or spoken to as it was asked for, in one sentence.

    Programs print it and end with the status 2.
    """


def sentence(error: Exception) -> str:
    """Return the text of an error of Zenoh in one line, without places in its source."""
    return ' '.join(str(error).partition(' at /')[0].split())
