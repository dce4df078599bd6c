"""Calling what others wrote: what one of them raises must not keep the next from its turn."""

from collections.abc import Callable, Iterable


def call_all(calls: Iterable[Callable[[], object]]) -> None:
    """
    Call everything, whatever one of them raises, ``sys.exit()`` included.

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
