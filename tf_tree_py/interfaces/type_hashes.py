# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The type hashes of tf2_msgs: nodes can communicate if theirs are equal."""

import json
from pathlib import Path

TYPE_HASHES = {
    'tf2_msgs/msg/TFMessage':
        'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087',
    'tf2_msgs/msg/TF2Error':
        'RIHS01_db2485e7d6a0ec75bf087e058ee45df682acc3a621ca7780503d10aac141809a',
    'tf2_msgs/srv/FrameGraph':
        'RIHS01_0d1fbc6222c018ba5f33822904a2fdd4063705289956d3fdde07cd8c50fe8067',
    'tf2_msgs/action/LookupTransform':
        'RIHS01_0b8adf6bc0b5958879e3265b41a457e03558fe523890a81252c70eba97a82c5d',
}
"""The type hashes of ROS 2 Jazzy's own tf2_msgs, which are also those of Kilted's."""


def _installed_hash(prefix: Path, type_name: str) -> str | None:
    """
    Return the type hash of a type in an installed package.

    :param prefix: the folder that has the package's ``share``.
    :param type_name: such as ``tf2_msgs/msg/TFMessage``.
    :return: None if the package or the type is not installed.
    """
    package, subfolder, name = type_name.split('/')
    description = prefix / 'share' / package / subfolder / f'{name}.json'
    if not description.is_file():
        return None
    hashes = {entry['type_name']: entry['hash_string']
              for entry in json.loads(description.read_text())['type_hashes']}
    return hashes.get(type_name)


def differing(prefix: Path) -> list[str]:
    """Return the types of an installed tf2_msgs that are not Jazzy's."""
    return [name for name, expected in TYPE_HASHES.items()
            if _installed_hash(prefix, name) != expected]
