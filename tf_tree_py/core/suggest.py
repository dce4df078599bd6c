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

"""Suggesting the frame that a caller probably meant."""

from collections.abc import Iterable
import difflib

# More names than this, and longer ones, are not compared: it takes too long.
_MAX_NAMES = 1000
_MAX_LENGTH = 200
# How many names a hint lists.
_LISTED = 12


def nearest(name: str, names: Iterable[str]) -> str | None:
    """Return the name that is most similar to another; None if none is similar."""
    if len(name) > _MAX_LENGTH:
        return None
    candidates = [other for other in list(names)[:_MAX_NAMES] if len(other) <= _MAX_LENGTH]
    found = difflib.get_close_matches(name, candidates, 1)
    return found[0] if found else None


def known_names(name: str, names: tuple[str, ...]) -> str:
    """Return a hint for a caller who used an unknown name."""
    meant = nearest(name, names)
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    known = 'Known: ' + ', '.join(names[:_LISTED]) + more
    return known if meant is None else f'Did you mean {meant!r}? {known}'
