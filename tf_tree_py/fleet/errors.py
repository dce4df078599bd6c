# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors of a fleet's connection as a whole; errors of single robots are counted."""


class FleetError(Exception):
    """
    A fleet cannot be received or served as requested; the text is one sentence.

    Programs print it and end with the status 2.
    """


def sentence(error: Exception) -> str:
    """Return the text of an error of Zenoh in one line, without source locations."""
    return ' '.join(str(error).partition(' at /')[0].split())
