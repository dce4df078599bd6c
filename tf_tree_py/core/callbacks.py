# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Calling several callbacks: if one raises an exception, the others are still called."""

from collections.abc import Callable, Iterable


def call_all(calls: Iterable[Callable[[], object]]) -> None:
    """
    Call all, even if one of them raises an exception, including ``SystemExit``.

    :raises BaseException: the first exception, after all were called.
    """
    first: BaseException | None = None
    for call in calls:
        try:
            call()
        except BaseException as error:  # noqa: B902 - it is raised below
            first = first or error
    if first is not None:
        raise first
