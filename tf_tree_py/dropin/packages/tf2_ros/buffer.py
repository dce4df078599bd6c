"""Names of tf2_ros.buffer."""

from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401

__all__ = ['Buffer']
