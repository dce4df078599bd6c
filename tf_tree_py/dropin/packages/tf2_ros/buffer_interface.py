# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.buffer_interface."""

from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.ros.buffer.interface import BufferInterface
from tf_tree_py.ros.messages.registry import (
    convert,
    ConvertRegistration,
    NotImplementedException,
    Stamped,
    TransformRegistration,
    TypeException,
)

__all__ = [
    'BufferInterface',
    'convert',
    'ConvertRegistration',
    'NotImplementedException',
    'Stamped',
    'TransformRegistration',
    'TypeException',
    *star(__name__),
]
