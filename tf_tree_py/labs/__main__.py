# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Makes ``python -m tf_tree_py.labs`` run ``tf_lab``, which may not be on the path."""

import sys

from .tf_lab import main

if __name__ == '__main__':
    sys.exit(main())
