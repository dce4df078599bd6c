# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The pages that a server draws, from inside the server."""


def pages_of(serving):
    """Return the pages that a server draws, in the order in which they were opened."""
    return [page for page, _ in list(serving._pages.values())]


def log_of(serving):
    """Return the limited log of what fails in a server."""
    return serving._log


def hold_up(page):
    """Return a context in which only this thread draws a page."""
    return page._lock
