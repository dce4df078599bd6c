# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The exceptions of this room."""

from tf_tree_py.core.errors import TransformException


class SharedTreeException(TransformException):
    """
    A shared tree cannot be used: it has no writer, is damaged, or cannot be changed here.

    It is raised by lookups, too, so programs that catch the exceptions of tf2 catch it.
    """


class LapsedException(SharedTreeException):
    """
    What a lookup has read is not that of one state; the methods of ``SharedTree`` ask again.

    :ivar is_inside: whether the lock is still held, so asking again would read the same.
    """

    is_inside = False
