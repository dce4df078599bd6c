"""``python -m tf_tree_py.labs`` is ``tf_lab``, where that is not on the path."""

import sys

from .tf_lab import main

if __name__ == '__main__':
    sys.exit(main())
