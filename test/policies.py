# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The interpolation of docs/interpolation.md, for tests."""

from tf_tree_py.core.edges.interpolation import Linear


class HoldNewest(Linear):
    """Linear between samples; the newest sample stays valid for a while."""

    name = 'hold newest, as in the docs'

    def __init__(self, holds_for):
        self.holds_for = holds_for

    def save(self, arrays):
        return {'holds_for': self.holds_for}

    @classmethod
    def load(cls, saved):
        return cls(saved.whole('holds_for'))
