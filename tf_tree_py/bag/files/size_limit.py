# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limit on the unpacked size of a compressed part: kilobytes can hold gigabytes of zeros."""

import os

VARIABLE = 'TF_TREE_PY_MAX_UNPACKED'
"""The environment variable that sets the limit, in bytes."""

# Messages with transforms are compressed to a twentieth at best.
_ALWAYS, _TIMES = 256 * 2**20, 200


class TooLarge(ValueError):
    """A part of a bag unpacks to more than the limit."""


def unpacked_limit(packed: int) -> int:
    """
    Return how many bytes a compressed part may unpack to.

    :param packed: its compressed size, bytes.
    """
    given = os.environ.get(VARIABLE, '')
    return int(given) if given.isdecimal() else max(_ALWAYS, _TIMES * packed)


def too_large(what: str, packed: int) -> TooLarge:
    """Return the error for a part of a bag that unpacks to more."""
    return TooLarge(f'{what} of {packed:,} bytes unpacks to more than '
                    f'{unpacked_limit(packed):,}; {VARIABLE} sets that limit')
