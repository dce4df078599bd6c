# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A shared tree for each test."""

from known_trees import pair_of_trees
import pytest


@pytest.fixture
def pair(monkeypatch):
    """Yield a buffer, and a tree that shows it and knows all poses."""
    with pair_of_trees(monkeypatch) as both:
        yield both
