"""Names of tf2_ros.buffer_client."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401
from tf_tree_py.ros.remote.buffer_client import BufferClient

__all__ = ['BufferClient']
