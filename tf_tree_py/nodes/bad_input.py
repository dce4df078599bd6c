# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of names that users type, without ROS."""

from tf_tree_py.command.endings import Cannot


class BadInput(Cannot):
    """A name or a value cannot be used; the text names it and the reason in one sentence."""


def frame_name(what: str, name: object) -> str:
    """
    Return a frame name, after checking that it can be looked up.

    :param what: the purpose of the name, for the error.
    :raises BadInput: it is not a string, is empty, or has a leading slash.
    """
    if not isinstance(name, str) or not name or name.startswith('/'):
        raise BadInput(f'{what} must be a frame name, not empty and without a leading slash, '
                       f'not {name!r}')
    return name
