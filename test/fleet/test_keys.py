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

"""Keys and tokens of the three forms, written from the documents of those who send them."""

import pytest
from tf_tree_py.fleet import FleetError, keys
from tf_tree_py.fleet.keys import Topic
import zenoh

RMW = 'tf2_msgs::msg::dds_::TFMessage_/RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5'
ZID = 'aac3178e146ba6f1fc6e6a4085e77f21'
NOBODY = ('robot7/odom', 'tf', 'robot7', 'robot7/tf2', f'0/robot7/scan/{RMW}')

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


@pytest.mark.parametrize('key', NOBODY)
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


def test_outer_slashes_are_no_part_of_a_name():
    assert keys.check_robot('/robot7/') == 'robot7'
    assert keys.check_prefix('/hall3/') == 'hall3' and keys.check_prefix('') == ''


@pytest.mark.parametrize('robots', ['', 'a//b', 'a$b', '@*', None, ['robot7']])
def test_robots_that_no_key_can_have_are_refused(robots):
    with pytest.raises(FleetError):
        keys.check_robots(robots)
