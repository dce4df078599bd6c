# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What has to be closed, as a context manager."""

from typing import TypeVar

_Self = TypeVar('_Self', bound='Closable')


class Closable:
    """A context manager that closes itself at its end."""

    def close(self) -> None:
        """Free what it holds; a subclass implements it."""
        raise NotImplementedError

    def __enter__(self: _Self) -> _Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
