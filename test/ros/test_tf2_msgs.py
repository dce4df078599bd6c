"""The tf2_msgs in use is the official one, or as good on the wire."""

import json
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
import pytest

# What ROS 2 Jazzy's own tf2_msgs says of itself.
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


@pytest.mark.parametrize('type_name', TYPE_HASHES)
def test_type_hash_is_that_of_jazzy(type_name):
    package, kind, name = type_name.split('/')
    description = Path(get_package_share_directory(package)) / kind / f'{name}.json'
    hashes = json.loads(description.read_text())['type_hashes']
    assert {h['type_name']: h['hash_string'] for h in hashes}[type_name] == TYPE_HASHES[type_name]
