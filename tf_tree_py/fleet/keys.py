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
Under which keys transforms are found in Zenoh, and what says that a robot is there.

A key names a robot, and says whether what comes under it moves. The payload is the same
everywhere: a ``tf2_msgs/msg/TFMessage`` in CDR, with its encapsulation, frames as the robot
calls them. There are three forms:

=====================  =======================================================================
ours, and those of     ``<robot>/tf`` and ``<robot>/tf_static``
zenoh-bridge-ros2dds   (the bridge's namespace is the robot)
rmw_zenoh              ``<domain>/<robot>/tf/tf2_msgs::msg::dds_::TFMessage_/<type hash>``,
                       likewise ``tf_static`` (the node's namespace is the robot)
=====================  =======================================================================

So what understands a bridge understands us. A robot of rmw_zenoh without a namespace is
called by its domain, ``domain7``. Where a key prefix is given, such as ``hall3``, it stands
in front of the robot in every form, and is no part of its name.

A liveliness token lives as long as the session that declared it. One of these for each
robot, or for each of its publishers, says that it is there:

=====================  =======================================================================
ours                   ``<robot>/@tf_tree_py``
zenoh-bridge-ros2dds   ``@/<zenoh id>/@ros2_lv/MP/<robot>§tf/tf2_msgs§msg§TFMessage/<qos>``
rmw_zenoh              ``@ros2_lv/<domain>/<zenoh id>/<node>/<entity>/MP/<enclave>/<namespace>/``
                       ``<name>/%<robot>%tf/tf2_msgs::msg::dds_::TFMessage_/<type hash>/<qos>``
=====================  =======================================================================

Sources: the design document and ``liveliness_utils.cpp`` of rmw_zenoh, and
``liveliness_mgt.rs`` of zenoh-plugin-ros2dds. Part of a key that begins with ``@`` is matched
by no wildcard of Zenoh, so tokens do not get among the transforms.
"""

from collections.abc import Iterator
import re
from typing import NamedTuple

from .errors import FleetError

TF, TF_STATIC = 'tf', 'tf_static'
TOKEN = '@tf_tree_py'
RMW_TYPE = 'tf2_msgs::msg::dds_::TFMessage_'
TYPE_HASH = 'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087'
"""Of TFMessage in Jazzy, as rmw_zenoh writes it into its keys."""

_DOMAIN = 'domain'
_RMW_SPACE, _BRIDGE_SPACE = '@ros2_lv', '@'
_RMW_SLASH, _BRIDGE_SLASH = '%', '§'
_BRIDGE_TYPE = 'tf2_msgs§msg§TFMessage'
# Where in a token of rmw_zenoh its domain, session and topic stand; of a bridge the topic.
_RMW_TOKEN_DOMAIN, _RMW_TOKEN_ZID, _RMW_TOKEN_TOPIC, _BRIDGE_TOKEN_TOPIC = 1, 2, 9, 4
# What Zenoh forbids in a part of a key, or gives a meaning.
_FORBIDDEN = frozenset('*$?#\0')


class Topic(NamedTuple):
    """Whose transforms come under a key, and whether they are static."""

    robot: str
    static: bool


# --- ours

def key_of(topic: Topic, key_prefix: str = '') -> str:
    """Return the key under which a robot's transforms go; a bridge uses the same."""
    return _joined(key_prefix, topic.robot, TF_STATIC if topic.static else TF)


def token_of(robot: str, key_prefix: str = '') -> str:
    """Return the key of the token that says that a robot is there."""
    return _joined(key_prefix, robot, TOKEN)


def rmw_key_of(topic: Topic, domain: int | str = 0, type_hash: str = TYPE_HASH,
               key_prefix: str = '') -> str:
    """Return the key under which rmw_zenoh sends a robot's transforms; '': without namespace."""
    return _joined(str(domain), key_prefix, topic.robot,
                   TF_STATIC if topic.static else TF, RMW_TYPE, type_hash)


def check_robot(robot: str) -> str:
    """
    Return the name of a robot without outer slashes, as a part of keys.

    :raises FleetError: no key can have it.
    """
    name = robot.strip('/') if isinstance(robot, str) else ''
    fault = _fault_of(name)
    if fault:
        raise FleetError(f'{robot!r} cannot be the name of a robot in keys of Zenoh: {fault}')
    return name


def check_prefix(key_prefix: str) -> str:
    """
    Return a key prefix without outer slashes; it may be empty.

    :raises FleetError: no key can have it.
    """
    name = key_prefix.strip('/') if isinstance(key_prefix, str) else '*'
    if name and _fault_of(name):
        raise FleetError(f'{key_prefix!r} cannot be the prefix of keys of Zenoh: '
                         f'{_fault_of(name)}')
    return name


def _fault_of(name: str) -> str:
    """Return why a name cannot be a part of keys, or ''."""
    if not name or '//' in name:
        return 'it has an empty part'
    if any(part.startswith('@') for part in name.split('/')):
        return 'a part of it begins with @'
    bad = sorted(_FORBIDDEN & set(name))
    return f'{bad[0]!r} is in it' if bad else ''


# --- understanding them

def topic_of(key: str, key_prefix: str = '') -> Topic | None:
    """Return whose transforms come under a key; None: nobody's."""
    parts = key.split('/')
    if len(parts) > 3 and parts[-2] == RMW_TYPE:
        return _topic(parts[1:-2], key_prefix, domain=parts[0])
    return _topic(parts, key_prefix)


def topic_of_token(key: str, key_prefix: str = '') -> Topic | None:
    """
    Return whose token a key is; None: nobody's.

    One of ours stands for all that a robot sends, and counts as that of what moves.
    """
    parts = key.split('/')
    if parts[0] == _RMW_SPACE and len(parts) > _RMW_TOKEN_TOPIC:
        topic = parts[_RMW_TOKEN_TOPIC].strip(_RMW_SLASH).split(_RMW_SLASH)
        return _topic(topic, key_prefix, domain=parts[_RMW_TOKEN_DOMAIN])
    if parts[0] == _BRIDGE_SPACE and len(parts) > _BRIDGE_TOKEN_TOPIC:
        return _topic(parts[_BRIDGE_TOKEN_TOPIC].split(_BRIDGE_SLASH), key_prefix)
    return _topic([*parts[:-1], TF], key_prefix) if parts[-1] == TOKEN else None


def old_cache_of(token: str) -> str | None:
    """
    Return where older releases of rmw_zenoh answer with what a publisher has kept.

    :param token: of a publisher of theirs; newer ones answer elsewhere, as Zenoh itself does.
    """
    parts = token.split('/')
    if parts[0] != _RMW_SPACE or len(parts) <= _RMW_TOKEN_TOPIC + 2:
        return None
    topic, type_name, type_hash = parts[_RMW_TOKEN_TOPIC:_RMW_TOKEN_TOPIC + 3]
    return _joined(parts[_RMW_TOKEN_ZID], parts[_RMW_TOKEN_DOMAIN],
                   topic.strip(_RMW_SLASH).replace(_RMW_SLASH, '/'), type_name, type_hash)


def _topic(parts: list[str], key_prefix: str, domain: str = '') -> Topic | None:
    """Return the topic whose name has these parts, of a key that may tell a domain too."""
    before = key_prefix.split('/') if key_prefix else []
    if parts[-1] not in (TF, TF_STATIC) or parts[:len(before)] != before:
        return None
    robot = '/'.join(parts[len(before):-1])
    if not robot and domain and not before:
        robot = f'{_DOMAIN}{domain}'
    return Topic(robot, parts[-1] == TF_STATIC) if robot else None


# --- asking for them

def patterns(robots: str, static: bool, key_prefix: str = '') -> Iterator[str]:
    """
    Yield the key expressions under which transforms of some robots are, and some of others.

    :param robots: as ``check_robots`` returns it.
    """
    topic = Topic(robots, static)
    yield key_of(topic, key_prefix)
    if robots == '*' and not key_prefix:
        topic = Topic('**', static)  # which is no namespace, too
    yield rmw_key_of(topic, '*', '*', key_prefix)
    if robots.startswith(_DOMAIN) and not key_prefix:
        yield rmw_key_of(Topic('', static), '*', '*')


def token_patterns(robots: str, key_prefix: str = '') -> Iterator[str]:
    """Yield the key expressions of the tokens of robots; those of rmw_zenoh are of all robots."""
    yield token_of(robots, key_prefix)
    yield f'{_BRIDGE_SPACE}/*/{_RMW_SPACE}/MP/*/{_BRIDGE_TYPE}/*'
    yield f'{_RMW_SPACE}/*/*/*/*/MP/*/*/*/*/{RMW_TYPE}/*/*'


def check_robots(robots: str) -> str:
    """
    Return which robots are meant, as a key expression.

    :param robots: a name; ``*`` in it stands for anything but a slash, ``**`` alone for
        anything.
    :raises FleetError: no key can be like that.
    """
    if not isinstance(robots, str):
        raise FleetError(f"robots is a name or a pattern such as 'robot*', not {robots!r}")
    name = robots.strip('/')
    fault = _fault_of(name.replace('*', 'x'))
    if fault:
        raise FleetError(f'no robot of keys of Zenoh can be like {robots!r}: {fault}')
    return '/'.join(part if part in ('*', '**') else re.sub(r'\*+', '$*', part)
                    for part in name.split('/'))


def _joined(*parts: str) -> str:
    return '/'.join(filter(None, parts))
