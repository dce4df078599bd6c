# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Whether a lookup would succeed, which the methods of tf2's buffers return in several forms."""

from collections.abc import Callable

from tf_tree_py.core.errors import ArgumentTypeException, TransformException


def answered(lookup: Callable[[], object],
             reason_of: Callable[[TransformException], str] = str) -> tuple[bool, str]:
    """
    Return whether a lookup succeeds, and the reason if not.

    :raises ArgumentTypeException: an argument is wrong, so there is no answer.
    """
    try:
        lookup()
    except ArgumentTypeException:
        raise
    except TransformException as error:
        return False, reason_of(error)
    return True, ''
