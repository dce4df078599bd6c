"""Lets ``python -m tf_tree_py.labs`` run ``tf_lab``, for where that is not on the path."""

import sys

from .tf_lab import main

if __name__ == '__main__':
    sys.exit(main())
