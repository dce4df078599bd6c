"""
Recorded transforms: a bag as a buffer, without ROS.

Not here: the tree and its lookups, which are ``core``'s, and reading files, which rosbags
does (``pip install 'tf_tree_py[bag]'``).
"""

from .decoding import Decoder
from .errors import BagError
from .oddities import BagWarning, Oddity
from .opening import open_bag, Recording
from .reading import Bag, read_arrivals
from .source import Arrival, Source

__all__ = [
    'Arrival',
    'Bag',
    'BagError',
    'BagWarning',
    'Decoder',
    'Oddity',
    'open_bag',
    'read_arrivals',
    'Recording',
    'Source',
]
