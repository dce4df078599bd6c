# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The keys of transforms in Zenoh, and the tokens that show that a robot is present.

A key names a robot, and whether its transforms are moving or static. The payload is the same
everywhere: a ``tf2_msgs/msg/TFMessage`` in CDR, with its encapsulation, and with the robot's own
frame names. There are three forms:

=====================  =======================================================================
this package's, and    ``<robot>/tf`` and ``<robot>/tf_static``
zenoh-bridge-ros2dds   (the bridge's namespace is the robot)
rmw_zenoh              ``<domain>/<robot>/tf/tf2_msgs::msg::dds_::TFMessage_/<type hash>``,
                       likewise ``tf_static`` (the node's namespace is the robot)
=====================  =======================================================================

A subscriber to a bridge can therefore read this package's messages. A robot of rmw_zenoh without a
namespace is named after its domain, ``domain7``. A key prefix, such as ``hall3``, precedes the
robot in every form, and is not part of its name.

A router restricts a robot to keys that begin with its name. Therefore no key that begins with one
robot's name may count as another's: a key is matched in full, a domain consists of digits, and the
name of a robot is neither only digits nor like that of a domain.

A liveliness token lives as long as the session that declared it. One token for each robot, or for
each of its publishers, shows that it is present:

=====================  =======================================================================
this package           ``<robot>/@tf_tree_py``
zenoh-bridge-ros2dds   ``@/<zenoh id>/@ros2_lv/MP/<robot>§tf/tf2_msgs§msg§TFMessage/<qos>``
rmw_zenoh              ``@ros2_lv/<domain>/<zenoh id>/<node>/<entity>/MP/<enclave>/<namespace>/``
                       ``<name>/%<robot>%tf/tf2_msgs::msg::dds_::TFMessage_/<type hash>/<qos>``
=====================  =======================================================================

Sources: the design document and ``liveliness_utils.cpp`` of rmw_zenoh, and
``liveliness_mgt.rs`` of zenoh-plugin-ros2dds. Zenoh's wildcards match no part of a key that begins
with ``@``, so tokens do not get among the transforms.
"""

from collections.abc import Iterator
import re
from typing import NamedTuple

from .names import deception_in
from .session import FleetError

TF, TF_STATIC = 'tf', 'tf_static'
TOKEN = '@tf_tree_py'
RMW_TYPE = 'tf2_msgs::msg::dds_::TFMessage_'
TYPE_HASH = 'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087'
"""The type hash of TFMessage in Jazzy, as rmw_zenoh writes it into its keys."""

_DOMAIN = 'domain'
# The beginning of a key of rmw_zenoh, and the name of its robot without a namespace.
_DOMAIN_ID, _DOMAIN_NAME = re.compile('[0-9]{1,3}'), re.compile(f'{_DOMAIN}[0-9]{{1,3}}')
_LONGEST_NAME = 255
_LONGEST_TOKEN = 2048
_RMW_SPACE, _BRIDGE_SPACE = '@ros2_lv', '@'
_RMW_SLASH, _BRIDGE_SLASH = '%', '§'
_BRIDGE_TYPE = 'tf2_msgs§msg§TFMessage'
# The places of the domain, session and topic in a token of rmw_zenoh; of the topic in a bridge's.
_RMW_TOKEN_DOMAIN, _RMW_TOKEN_ZID, _RMW_TOKEN_TOPIC, _BRIDGE_TOKEN_TOPIC = 1, 2, 9, 4
# The number of parts of such a token, and the fixed parts that identify it.
_RMW_TOKEN_PARTS, _RMW_TOKEN_FIXED = 13, {0: _RMW_SPACE, 5: 'MP', 10: RMW_TYPE}
_BRIDGE_TOKEN_PARTS, _BRIDGE_TOKEN_FIXED = 7, {
    0: _BRIDGE_SPACE, 2: _RMW_SPACE, 3: 'MP', 5: _BRIDGE_TYPE}
# Characters that Zenoh forbids in a part of a key, or gives a meaning.
_FORBIDDEN = frozenset('*$?#\0')


class Topic(NamedTuple):
    """The robot of the transforms under a key, and whether they are static."""

    robot: str
    static: bool


# --- this package's keys

def key_of(topic: Topic, key_prefix: str = '') -> str:
    """Return the key of a robot's transforms; a bridge uses the same."""
    return _joined(key_prefix, topic.robot, TF_STATIC if topic.static else TF)


def token_of(robot: str, key_prefix: str = '') -> str:
    """Return the key of the token that shows that a robot is present."""
    return _joined(key_prefix, robot, TOKEN)


def rmw_key_of(topic: Topic, domain: int | str = 0, type_hash: str = TYPE_HASH,
               key_prefix: str = '') -> str:
    """Return the key of a robot's transforms in rmw_zenoh; '': without namespace."""
    return _joined(str(domain), key_prefix, topic.robot,
                   TF_STATIC if topic.static else TF, RMW_TYPE, type_hash)


def check_robot(robot: str) -> str:
    """
    Return the name of a robot without outer slashes, as a part of keys.

    :raises FleetError: the name is not allowed in keys.
    """
    name = robot.strip('/') if isinstance(robot, str) else ''
    fault = _fault_of(name) or deception_in(name)
    if fault:
        raise FleetError(f'{robot!r} cannot be the name of a robot in Zenoh keys: {fault}')
    return name


def check_sender(robot: str, key_prefix: str = '') -> tuple[str, str]:
    """
    Return the name and the key prefix of a sending robot, both without outer slashes.

    :raises FleetError: they are not allowed in keys, or a listener would attribute the key to
        another robot.
    """
    name, prefix = check_robot(robot), check_prefix(key_prefix)
    if not prefix and _is_reserved(name):
        raise FleetError(
            f'{robot!r} cannot be the name of a robot in Zenoh keys: keys of rmw_zenoh begin '
            f"with digits, and '{_DOMAIN}7' is its robot of domain 7. Call it robot7, or set a "
            'key prefix')
    return name, prefix


def check_prefix(key_prefix: str) -> str:
    """
    Return a key prefix without outer slashes; it may be empty.

    :raises FleetError: the prefix is not allowed in keys.
    """
    name = key_prefix.strip('/') if isinstance(key_prefix, str) else '*'
    fault = _fault_of(name) or deception_in(name) if name else ''
    if _DOMAIN_ID.fullmatch(name.partition('/')[0]):
        fault = 'it begins with only digits, like a domain of rmw_zenoh'
    if fault:
        raise FleetError(f'{key_prefix!r} cannot be the prefix of Zenoh keys: {fault}')
    return name


def _fault_of(name: str) -> str:
    """Return why a name cannot be a part of keys, or ''."""
    if not name or '//' in name:
        return 'it has an empty part'
    if len(name) > _LONGEST_NAME:
        return f'it is longer than {_LONGEST_NAME} characters'
    if any(part.startswith('@') for part in name.split('/')):
        return 'a part of it begins with @'
    bad = sorted(_FORBIDDEN & set(name))
    return f'it contains {bad[0]!r}' if bad else ''


# --- parsing

def topic_of(key: str, key_prefix: str = '') -> Topic | None:
    """Return the topic of a key; None: it is not a robot's."""
    parts = key.split('/')
    if len(parts) > 3 and parts[-2] == RMW_TYPE:
        return _rmw_topic(parts[0], parts[1:-2], key_prefix)
    return _topic(parts, key_prefix)


def topic_of_token(key: str, key_prefix: str = '') -> Topic | None:
    """
    Return the topic of a token's key; None: it is not a robot's.

    A token of this package covers all topics of a robot, and counts as that of the moving one.
    """
    if len(key) > _LONGEST_TOKEN:
        return None
    parts = key.split('/')
    if _is_rmw_token(parts):
        topic = parts[_RMW_TOKEN_TOPIC].removeprefix(_RMW_SLASH).split(_RMW_SLASH)
        return _rmw_topic(parts[_RMW_TOKEN_DOMAIN], topic, key_prefix)
    if _is_bridge_token(parts):
        return _topic(parts[_BRIDGE_TOKEN_TOPIC].split(_BRIDGE_SLASH), key_prefix)
    return _topic([*parts[:-1], TF], key_prefix) if parts[-1] == TOKEN else None


def is_nameless_bridge(token: str, key_prefix: str = '') -> bool:
    """Return whether a token is of a bridge whose transforms have a key without a robot."""
    parts = token.split('/')
    return _is_bridge_token(parts) and parts[_BRIDGE_TOKEN_TOPIC].split(_BRIDGE_SLASH) in (
        [*filter(None, key_prefix.split('/')), topic] for topic in (TF, TF_STATIC))


def old_cache_of(token: str) -> str | None:
    """
    Return the key of a publisher's cache in older releases of rmw_zenoh.

    :param token: of a publisher of theirs; newer ones have the cache of Zenoh itself.
    """
    parts = token.split('/')
    if not _is_rmw_token(parts):
        return None
    topic, type_name, type_hash = parts[_RMW_TOKEN_TOPIC:_RMW_TOKEN_TOPIC + 3]
    return _joined(parts[_RMW_TOKEN_ZID], parts[_RMW_TOKEN_DOMAIN],
                   topic.strip(_RMW_SLASH).replace(_RMW_SLASH, '/'), type_name, type_hash)


def _is_rmw_token(parts: list[str]) -> bool:
    return len(parts) == _RMW_TOKEN_PARTS and all(
        parts[place] == part for place, part in _RMW_TOKEN_FIXED.items())


def _is_bridge_token(parts: list[str]) -> bool:
    return len(parts) == _BRIDGE_TOKEN_PARTS and all(
        parts[place] == part for place, part in _BRIDGE_TOKEN_FIXED.items())


def _rmw_topic(domain: str, parts: list[str], key_prefix: str) -> Topic | None:
    """Return the topic of a key or a token with a domain."""
    if not _DOMAIN_ID.fullmatch(domain):
        return None
    if len(parts) == 1 and not key_prefix and parts[0] in (TF, TF_STATIC):
        return Topic(f'{_DOMAIN}{domain}', parts[0] == TF_STATIC)
    return _topic(parts, key_prefix)


def _topic(parts: list[str], key_prefix: str) -> Topic | None:
    """Return the topic with these parts of a name; those before the last are the robot's."""
    before = key_prefix.split('/') if key_prefix else []
    robot = '/'.join(parts[len(before):-1])
    if (parts[-1] not in (TF, TF_STATIC) or parts[:len(before)] != before or _fault_of(robot)
            or not before and _is_reserved(robot)):
        return None
    return Topic(robot, parts[-1] == TF_STATIC)


def _is_reserved(robot: str) -> bool:
    """Return whether a name begins like a key of rmw_zenoh, or like the name of a domain."""
    first = robot.partition('/')[0]
    return bool(_DOMAIN_ID.fullmatch(first) or _DOMAIN_NAME.fullmatch(first))


# --- patterns

def patterns(robots: str, static: bool, key_prefix: str = '') -> Iterator[str]:
    """
    Yield the key expressions of the transforms of some robots; they may match others, too.

    :param robots: as ``check_robots`` returns it.
    """
    topic = Topic(robots, static)
    yield key_of(topic, key_prefix)
    if robots == '*' and not key_prefix:
        topic = Topic('**', static)  # which includes robots without a namespace
    yield rmw_key_of(topic, '*', '*', key_prefix)
    if robots.startswith(_DOMAIN) and not key_prefix:
        yield rmw_key_of(Topic('', static), '*', '*')


def token_patterns(robots: str, key_prefix: str = '') -> Iterator[str]:
    """Yield the key expressions of the tokens of robots; those of rmw_zenoh match all robots."""
    yield token_of(robots, key_prefix)
    yield f'{_BRIDGE_SPACE}/*/{_RMW_SPACE}/MP/*/{_BRIDGE_TYPE}/*'
    yield f'{_RMW_SPACE}/*/*/*/*/MP/*/*/*/*/{RMW_TYPE}/*/*'


def check_robots(robots: str) -> str:
    """
    Return the selection of robots as a key expression.

    :param robots: a name; ``*`` in it matches anything but a slash, ``**`` alone matches anything.
    :raises FleetError: no key can match it.
    """
    if not isinstance(robots, str):
        raise FleetError(f"robots has to be a name or a pattern such as 'robot*', not {robots!r}")
    name = robots.strip('/')
    fault = _fault_of(name.replace('*', 'x')) or deception_in(name)
    if fault:
        raise FleetError(f'{robots!r} cannot match a robot in Zenoh keys: {fault}')
    return '/'.join(part if part in ('*', '**') else re.sub(r'\*+', '$*', part)
                    for part in name.split('/'))


def _joined(*parts: str) -> str:
    return '/'.join(filter(None, parts))
