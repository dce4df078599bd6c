# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The preload module of each local worker: only the parent process reacts to Ctrl-C."""

import signal


def dask_setup(worker: object) -> None:
    """Ignore SIGINT in this process, which its parent ends; dask calls this by name."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
