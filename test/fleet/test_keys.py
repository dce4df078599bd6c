# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Keys and tokens of the three forms, written from the documents of their programs."""

from hypothesis import example, given, strategies as st
import pytest
from tf_tree_py.fleet import FleetError, keys
from tf_tree_py.fleet.keys import Topic
import zenoh

RMW = 'tf2_msgs::msg::dds_::TFMessage_/RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5'
ZID = 'aac3178e146ba6f1fc6e6a4085e77f21'
NOBODY = ('robot7/odom', 'tf', 'robot7', 'robot7/tf2', f'0/robot7/scan/{RMW}')
# Key expressions also match these, because Zenoh has no pattern for numbers.
SUSPICIOUS = (f'robot7/robot8/tf/{RMW}', f'robot7/tf/{RMW}', f'-1/robot8/tf/{RMW}', '7/tf',
              'domain7/tf', f'0/domain7/tf/{RMW}', 'robot7/@adv/robot8/tf', f'{"x" * 256}/tf')

KEYS = {
    'robot7/tf': Topic('robot7', False),
    'robot7/tf_static': Topic('robot7', True),
    f'0/robot7/tf/{RMW}': Topic('robot7', False),
    f'12/robot7/tf_static/{RMW}': Topic('robot7', True),
    f'12/tf_static/{RMW}': Topic('domain12', True),
    f'0/site/robot7/tf/{RMW}': Topic('site/robot7', False),
}
TOKENS = {
    'robot7/@tf_tree_py': Topic('robot7', False),
    f'@ros2_lv/0/{ZID}/0/10/MP/%/%robot7/driver/%robot7%tf/{RMW}/::,100:,:,:,,': Topic(
        'robot7', False),
    f'@ros2_lv/3/{ZID}/0/11/MP/%/%/driver/%tf_static/{RMW}/:1:,1:,:,:,,': Topic(
        'domain3', True),
    f'@/{ZID}/@ros2_lv/MP/robot7§tf_static/tf2_msgs§msg§TFMessage/:1:1:0,1': Topic(
        'robot7', True),
}


def test_keys_of_all_forms_name_a_robot_and_what_it_sends():
    assert {key: keys.topic_of(key) for key in KEYS} == KEYS


def test_tokens_of_all_forms_name_a_robot():
    assert {key: keys.topic_of_token(key) for key in TOKENS} == TOKENS


@pytest.mark.parametrize('key', NOBODY + SUSPICIOUS)
def test_other_keys_are_nobodys(key):
    assert keys.topic_of(key) is None and keys.topic_of_token(key) is None


def test_other_tokens_are_nobodys():
    for key in (f'@ros2_lv/0/{ZID}/0/0/NN/%/%robot7/driver', f'@/{ZID}/router', '@', 'a/@other',
                f'@/{ZID}/@ros2_lv/MP/robot7§scan/sensor_msgs§msg§LaserScan/:1:1:0,1'):
        assert keys.topic_of_token(key) is None


@pytest.mark.parametrize('key_prefix', ['', 'hall3'])
@pytest.mark.parametrize('topic', [Topic('robot7', False), Topic('site/robot7', True)])
def test_what_is_made_is_understood(topic, key_prefix):
    for made in (keys.key_of(topic, key_prefix), keys.rmw_key_of(topic, 3, key_prefix=key_prefix)):
        assert keys.topic_of(made, key_prefix) == topic
    token = keys.token_of(topic.robot, key_prefix)
    assert keys.topic_of_token(token, key_prefix) == topic._replace(static=False)


def test_another_prefix_is_another_fleet():
    assert keys.topic_of('hall3/robot7/tf', 'hall4') is None
    assert keys.topic_of(f'0/hall3/robot7/tf/{RMW}', 'hall4') is None
    assert keys.topic_of('hall3/tf', 'hall3') is None


PARTS = st.sampled_from([
    'tf', 'tf_static', 'robot7', 'robot8', 'domain8', 'hall3', '0', '8', '@tf_tree_py', '@adv',
    '@ros2_lv', '@', 'MP', '%', '%robot8%tf', 'robot8§tf', 'tf2_msgs§msg§TFMessage', ZID,
    *RMW.split('/')])
RESTS = st.lists(PARTS, min_size=1, max_size=13) | st.sampled_from(
    [key.split('/') for key in (*KEYS, *TOKENS)])


@given(RESTS, st.sampled_from(['', 'hall3']),
       st.sampled_from(['robot7', 'domain7', 'tf', 'MP', '1234']))
@example(['robot8', 'tf', *RMW.split('/')], '', 'robot7')
@example(['robot8', 'tf', *RMW.split('/')], '', '1234')
@example(['hall3', 'robot8', 'tf', *RMW.split('/')], '', 'hall3')
def test_no_key_below_one_robots_name_counts_as_anothers(rest, key_prefix, robot):
    key = '/'.join(filter(None, (key_prefix, robot, *rest)))
    for heard_below in {'', key_prefix}:
        own = robot if heard_below else f'{key_prefix}/{robot}'.lstrip('/')
        for topic in (keys.topic_of(key, heard_below), keys.topic_of_token(key, heard_below)):
            assert topic is None or f'{topic.robot}/'.startswith(f'{own}/')


@given(RESTS, st.sampled_from(['0', '73']))
def test_no_key_below_a_namespace_of_a_domain_counts_as_another_robots(rest, domain):
    topic = keys.topic_of('/'.join((domain, 'robot7', *rest)))
    assert topic is None or f'{topic.robot}/'.startswith('robot7/')


def test_bridge_without_a_namespace_is_recognised():
    token = f'@/{ZID}/@ros2_lv/MP/tf_static/tf2_msgs§msg§TFMessage/:1:1:0,1'
    assert keys.is_nameless_bridge(token) and not keys.is_nameless_bridge(token, 'hall3')
    assert keys.is_nameless_bridge(token.replace('/tf_', '/hall3§tf_'), 'hall3')
    assert not any(keys.is_nameless_bridge(one) for one in TOKENS)


def asked(robots, static, key):
    return any(zenoh.KeyExpr(pattern).includes(key)
               for pattern in keys.patterns(keys.check_robots(robots), static))


def test_patterns_ask_for_these_keys_and_no_others():
    for key, topic in KEYS.items():
        wide = '**' if '/' in topic.robot else '*'
        for robots in (wide, topic.robot, topic.robot[:-1] + '*'):
            assert asked(robots, topic.static, key), (robots, key)
            assert not asked(robots, not topic.static, key)
        assert not asked('another', topic.static, key)
    assert not any(asked('*', False, key) for key in NOBODY)


def test_patterns_of_tokens_ask_for_them():
    patterns = [zenoh.KeyExpr(pattern) for pattern in keys.token_patterns('*')]
    for key in TOKENS:
        assert any(pattern.includes(key) for pattern in patterns), key


@pytest.mark.parametrize('name', ['', '/', 'a//b', 'a*', 'a?', 'a#b', '@a', 'a/@b', None, 7])
def test_a_name_that_no_key_can_have_is_refused(name):
    with pytest.raises(FleetError, match='cannot be the name of a robot'):
        keys.check_robot(name)


@pytest.mark.parametrize('name', ['7', '7/arm', 'domain7'])
def test_name_that_a_domain_of_rmw_zenoh_has_is_no_robots(name):
    with pytest.raises(FleetError, match='Call it robot7, or set a key prefix'):
        keys.check_sender(name)
    assert keys.check_sender(name, 'hall3') == (name, 'hall3')
    with pytest.raises(FleetError, match='prefix'):
        keys.check_sender('robot7', '3')


def test_outer_slashes_are_no_part_of_a_name():
    assert keys.check_robot('/robot7/') == 'robot7'
    assert keys.check_prefix('/hall3/') == 'hall3' and keys.check_prefix('') == ''


@pytest.mark.parametrize('robots', ['', 'a//b', 'a$b', '@*', None, ['robot7']])
def test_robots_that_no_key_can_have_are_refused(robots):
    with pytest.raises(FleetError):
        keys.check_robots(robots)
