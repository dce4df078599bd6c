# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""tf2_msgs is built into an environment and kept for the next one, unless it is broken."""

from pathlib import Path
import sys
import sysconfig

from programs import completed
import pytest
from tf_tree_py.interfaces.building import build, CannotBuild, find, sources
from tf_tree_py.interfaces.kept import Kept
from tf_tree_py.interfaces.type_hashes import differing, TYPE_HASHES

WHEELS = Path(sys.prefix)

if not (WHEELS / 'share' / 'rosidl_generator_py').is_dir():
    pytest.skip('the wheels of ROS 2 are not installed', allow_module_level=True)


def environment(prefix):
    """Make an environment with the wheels, but without tf2_msgs and without Python packages."""
    for folder in ('lib', 'share'):
        (prefix / folder).mkdir(parents=True)
        for path in (WHEELS / folder).iterdir():
            if 'tf2_msgs' not in path.name and not path.name.startswith('python'):
                (prefix / folder / path.name).symlink_to(path)
    (prefix / 'include').symlink_to(WHEELS / 'include')
    index = prefix / 'share' / 'ament_index'
    index.unlink()
    for path in (WHEELS / 'share' / 'ament_index').rglob('*'):
        if path.is_file() and path.name != 'tf2_msgs':
            link = index / path.relative_to(WHEELS / 'share' / 'ament_index')
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(path)
    return prefix


def refused(prefix, kept):
    """Check that a kept build is not used."""
    with pytest.raises(CannotBuild, match='needs a C[+][+] compiler'):
        build(prefix, kept)


USE = """
import rclpy
from rclpy.action import ActionServer
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TFMessage
from tf2_msgs.srv import FrameGraph
import tf2_msgs
print(tf2_msgs.__file__)
rclpy.init()
node = rclpy.create_node('use')
publisher = node.create_publisher(TFMessage, 'tf', 1)
node.create_service(FrameGraph, 'frames', lambda request, response: response)
server = ActionServer(node, LookupTransform, 'lookup', lambda goal: None)
print(node.get_publishers_info_by_topic('/tf')[0].topic_type_hash)
server.destroy()
node.destroy_node()
rclpy.shutdown()
"""


def test_build_is_complete_and_kept_and_not_trusted_if_it_is_broken(tmp_path, monkeypatch):
    cache = tmp_path / 'cache'
    kept = Kept(cache, sources())
    first = environment(tmp_path / 'first')
    build(first, kept)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(first))
    assert find() == first and differing(first) == []
    packages = sysconfig.get_path('platlib', vars={'platbase': str(first)})
    with monkeypatch.context() as inside:
        inside.setenv('PYTHONPATH', packages)
        inside.setenv('LD_LIBRARY_PATH', str(first / 'lib'), prepend=':')
        done = completed(sys.executable, '-c', USE)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [
        f'{packages}/tf2_msgs/__init__.py', TYPE_HASHES['tf2_msgs/msg/TFMessage']]

    # The next environment needs no compiler.
    monkeypatch.setenv('CXX', 'no-compiler')
    second = environment(tmp_path / 'second')
    build(second, kept)
    assert differing(second) == []
    for name in ('lib/libtf2_msgs__rosidl_typesupport_fastrtps_c.so',
                 'share/ament_index/resource_index/rosidl_interfaces/tf2_msgs'):
        assert (second / name).read_bytes() == (first / name).read_bytes()

    third = environment(tmp_path / 'third')
    module, = kept.find().glob('python/tf2_msgs/*.so')
    description = kept.find() / 'share/tf2_msgs/msg/TFMessage.json'
    for file in (module, description, kept.find() / 'share/tf2_msgs/package.xml'):
        content = file.read_bytes()
        file.unlink()
        refused(third, kept)
        file.write_bytes(content)
    for file in (module, description):
        content = file.read_bytes()
        file.write_bytes(content[:len(content) // 3])
        refused(third, kept)
        file.write_bytes(content)
    build(third, kept)
    assert differing(third) == []
