# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Recorded transforms: a bag as a buffer, without ROS.

Not here: the tree and its lookups, which are ``core``'s, and reading files, which rosbags
does (``pip install 'tf_tree_py[bag]'``).
"""

from tf_tree_py.core.arrivals.estimate import Covariances

from .assembling.covariances import CovarianceTopics
from .assembling.decoding import Decoder
from .assembling.oddities import BagWarning, Oddity
from .errors import BagError
from .files.reading import Bag, read_arrivals
from .files.source import Arrival, Source
from .opening import open_bag, Recording
from .stamps import stamps_of

__all__ = [
    'Arrival',
    'Bag',
    'BagError',
    'BagWarning',
    'Covariances',
    'CovarianceTopics',
    'Decoder',
    'Oddity',
    'open_bag',
    'read_arrivals',
    'Recording',
    'Source',
    'stamps_of',
]
