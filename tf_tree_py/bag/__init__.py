# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Recorded transforms as a buffer.

No ROS is needed. The tree and its lookups are in ``core``; rosbags (``pip install rosbags``)
reads the files.
"""

from tf_tree_py.beyond.uncertainty.insertion import Covariances
from tf_tree_py.recording.errors import BagError

from .assembly.assembler import Anomaly, BagWarning
from .assembly.covariances import CovarianceTopics
from .assembly.decoding import Decoder
from .files.bag_reader import Bag, read_messages
from .files.connections import Connection, RecordedMessage
from .opening import open_bag, Recording, stamps_of

__all__ = [
    'Anomaly',
    'Bag',
    'BagError',
    'BagWarning',
    'Connection',
    'Covariances',
    'CovarianceTopics',
    'Decoder',
    'open_bag',
    'read_messages',
    'RecordedMessage',
    'Recording',
    'stamps_of',
]
