"""Calling several callbacks: if one raises, the others are called all the same."""

from collections.abc import Callable, Iterable


def call_all(calls: Iterable[Callable[[], object]]) -> None:
    """
    Call all, even if one of them raises something; ``sys.exit()`` in one counts, too.

    :raises BaseException: the first that was raised, once all were called.
    """
    first: BaseException | None = None
    for call in calls:
        try:
            call()
        except BaseException as error:  # noqa: B902 - it is raised below
            first = first or error
    if first is not None:
        raise first
