"""Names of tf2_ros.buffer."""

from tf_tree_py.dropin.along import __getattr__  # noqa: F401
from tf_tree_py.dropin.buffer import Buffer

__all__ = ['Buffer']
