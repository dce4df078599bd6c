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

"""Bags to measure with: 38 moving edges in one message at 100 Hz, as MCAP."""

from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from . import motion, wire

TRANSFORMS = 38
RATE_HZ = 1_000_000_000 // motion.PERIOD
TYPE = 'tf2_msgs/msg/TFMessage'


def write_bag(folder: Path, seconds: int, *, compressed: bool) -> Path:
    """Write a bag of so many seconds, and return its MCAP file."""
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    edges = motion.chain(TRANSFORMS).edges
    with writer:
        topic = writer.add_connection('/tf', TYPE, typestore=get_typestore(Stores.ROS2_JAZZY))
        for sample in range(seconds * RATE_HZ):
            writer.write(topic, edges[0].stamp_of(sample), wire.message_at(edges, sample))
    [file] = folder.glob('*.mcap')
    return file
