# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Shortening text: other nodes choose frame names, and a name may be of any length."""

from collections.abc import Sequence

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


def listed(names: Sequence[str], most: int = 5, longest: int = 80) -> str:
    """Return the first of some names, each shortened, and how many more there are."""
    told = ', '.join(shorten(name, longest) for name in names[:most])
    return told + (f' and {len(names) - most} more' if len(names) > most else '')


def times(count: int) -> str:
    """Return how often, in words."""
    return {1: 'once', 2: 'twice'}.get(count, f'{count} times')
