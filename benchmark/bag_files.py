# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Bags for measurements: 38 moving edges in one message at 100 Hz, as MCAP."""

from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from . import motion, wire

TRANSFORMS = 38
RATE_HZ = 1_000_000_000 // motion.PERIOD
TYPE = 'tf2_msgs/msg/TFMessage'


def write_bag(folder: Path, seconds: int, *, compressed: bool, begin_s: int = 0) -> Path:
    """
    Write a bag of a number of seconds; return its MCAP file.

    :param begin_s: how much later than other bags it begins, seconds.
    """
    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    edges = motion.chain(TRANSFORMS).edges
    with writer:
        topic = writer.add_connection('/tf', TYPE, typestore=get_typestore(Stores.ROS2_JAZZY))
        for sample in range(begin_s * RATE_HZ, (begin_s + seconds) * RATE_HZ):
            writer.write(topic, edges[0].stamp_of(sample), wire.message_at(edges, sample))
    [file] = folder.glob('*.mcap')
    return file
