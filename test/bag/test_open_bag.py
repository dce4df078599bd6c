# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag of any kind opens as the buffer into which its messages were inserted one by one."""

import copy
import os
from pathlib import Path
import pickle
import subprocess
import sys
import warnings

from bags import (
    as_mcap,
    assert_same,
    driving,
    fed,
    file_of,
    LATCHED,
    Message,
    PERIOD,
    RUN,
    SECOND,
    START,
    STATIC,
    without_index,
    write_ros1,
    write_ros2,
    write_split,
)
import numpy as np
from programs import PATIENCE_S
import pytest
from tf_tree_py.bag import BagError, open_bag, read_messages
from tf_tree_py.recording.errors import needs_extra

REPOSITORY = Path(__file__).resolve().parents[2]

FORMS = {
    'mcap': lambda path: write_ros2(path, RUN),
    'sqlite3': lambda path: write_ros2(path, RUN, 'sqlite3'),
    'mcap, one file': lambda path: file_of(write_ros2(path, RUN)),
    'sqlite3, one file': lambda path: file_of(write_ros2(path, RUN, 'sqlite3')),
    'mcap, chunks compressed': lambda path: write_ros2(path, RUN, compression='storage'),
    'mcap, messages compressed': lambda path: write_ros2(path, RUN, compression='message'),
    'sqlite3, messages compressed':
        lambda path: write_ros2(path, RUN, 'sqlite3', compression='message'),
    'mcap, file compressed': lambda path: write_ros2(path, RUN, compression='file'),
    'sqlite3, file compressed, one file':
        lambda path: file_of(write_ros2(path, RUN, 'sqlite3', compression='file')),
    'mcap, split': lambda path: write_split(path, [RUN[:100], RUN[100:], []]),
    'sqlite3, split': lambda path: write_split(
        path, [RUN[begin:begin + 30] for begin in range(0, len(RUN), 30)], storage='sqlite3'),
    'ros1': lambda path: write_ros1(path.with_suffix('.bag'), RUN),
    'ros1, lz4': lambda path: write_ros1(path.with_suffix('.bag'), RUN, 'lz4'),
    'ros1, bz2': lambda path: write_ros1(path.with_suffix('.bag'), RUN, 'bz2'),
    'ros1, of the old tf': lambda path: write_ros1(
        path.with_suffix('.bag'),
        [message._replace(type_name='tf/msg/tfMessage') for message in RUN]),
    'ros1, as mcap': lambda path: as_mcap(write_ros1(path.with_suffix('.bag'), RUN)),
}


@pytest.mark.parametrize('form', FORMS)
def test_bag_of_any_kind_answers_as_a_buffer_that_was_fed(tmp_path, form):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        buffer = open_bag(FORMS[form](tmp_path / 'run'))
    assert_same(buffer, fed(RUN))
    assert buffer.statistics.accepted == sum(len(message.transforms) for message in RUN)


# --- invalid bags

def test_what_is_no_bag_is_told_in_one_sentence(tmp_path):
    empty, wrong, text = (tmp_path / name for name in ('empty.mcap', 'wrong.bag', 'notes.txt'))
    empty.touch()
    wrong.write_bytes(b'hello' * 1000)
    text.write_text('hello')
    (tmp_path / 'folder').mkdir()
    for path, sentence in (
            (tmp_path / 'run.mcap', 'no such file or folder'),
            (empty, 'cannot be read as a bag.*empty'),
            (wrong, 'cannot be read as a bag'),
            (text, 'its name ends in none of .mcap, .db3, .bag'),
            (tmp_path / 'folder', 'the folder has no file .mcap, .db3, .bag')):
        with pytest.raises(BagError, match=sentence) as raised:
            open_bag(path)
        assert '\n' not in str(raised.value)


def test_bag_without_transforms_and_topics_that_are_none_are_told(tmp_path):
    empty = write_ros2(tmp_path / 'empty', [])
    with pytest.raises(BagError, match='no topic with transforms; it has: nothing'):
        open_bag(empty)
    bag = write_ros2(tmp_path / 'run', [*RUN[:5], Message(
        START, '/chatter', [], type_name='std_msgs/msg/String', data=b'\0\1\0\0\1\0\0\0\0')])
    for topics, sentence in ((['/tg'], 'no topic /tg; it has: /chatter, /tf'),
                             (['/chatter'], 'messages of type std_msgs/String, not transforms'),
                             ('/tf', "such as \\['/tf'\\]")):
        with pytest.raises(BagError, match=sentence):
            open_bag(bag, topics=topics)


# --- options

TWO = sorted([*driving(topic='/one/tf'), *driving(topic='/two/tf'), *(
    message._replace(topic=f'{robot}{message.topic}') for message in STATIC
    for robot in ('/one', '/two'))], key=lambda message: message.received)
PREFIXES = {f'/{robot}/{topic}': f'{robot}/' for robot in ('one', 'two')
            for topic in ('tf', 'tf_static')}


def test_two_robots_are_told_apart_by_the_prefixes_of_their_topics(tmp_path):
    buffer = open_bag(write_ros2(tmp_path / 'run', TWO), frame_prefix=PREFIXES,
                      shared_frames=['map'])
    alone = open_bag(write_ros2(tmp_path / 'alone', TWO), topics=['/two/tf', '/two/tf_static'])
    for frame in 'hand', 'lidar':
        assert buffer.lookup('map', f'two/{frame}', START + SECOND) == alone.lookup(
            'map', frame, START + SECOND)
    assert 'one/hand' in buffer.frames() and 'hand' not in buffer.frames()


def test_topic_that_is_misspelt_in_the_prefixes_is_told(tmp_path):
    with pytest.raises(BagError, match='frame_prefix names /on/tf, .*has: /tf, /tf_static'):
        open_bag(write_ros2(tmp_path / 'run', RUN), frame_prefix={'/on/tf': 'one/'})
    with pytest.raises(BagError, match='has to be a string or a dictionary, not 5'):
        open_bag(tmp_path / 'run', frame_prefix=5)


def test_stretch_in_which_nothing_was_received_is_told(tmp_path):
    bag = write_ros2(tmp_path / 'run', RUN)
    for stretch in {'start': 10**19 // 2}, {'stop': 60}, {'start': START + 7, 'stop': START + 7}:
        with pytest.raises(BagError, match='received from 1700000000.005000000 to 17000000'):
            open_bag(bag, **stretch)


def test_frames_are_chosen_by_their_new_names(tmp_path):
    buffer = open_bag(write_ros2(tmp_path / 'run', TWO), frame_prefix=PREFIXES,
                      frames=['one/odom', 'one/base', 'one/lidar'])
    assert sorted(buffer.frames()) == ['one/base', 'one/lidar', 'one/odom']
    buffer = open_bag(write_ros2(tmp_path / 'one', RUN),
                      frames=lambda parent, child: child == 'hand')
    assert sorted(buffer.frames()) == ['base', 'hand']


@pytest.mark.parametrize('write', [
    lambda path: write_ros2(path, RUN), lambda path: write_ros2(path, RUN, 'sqlite3'),
    lambda path: write_ros1(path.with_suffix('.bag'), RUN),
    lambda path: without_index(file_of(write_ros2(path, RUN)))],
    ids=['mcap', 'sqlite3', 'ros1', 'no index'])
@pytest.mark.filterwarnings('ignore::tf_tree_py.bag.BagWarning')
def test_static_edges_are_valid_also_outside_of_the_stretch_that_is_read(tmp_path, write):
    start, stop = START + 2 * SECOND, START + 2 * SECOND + SECOND // 2
    chosen = [message for message in RUN
              if message.topic == '/tf_static' or start <= message.received < stop]
    buffer = open_bag(write(tmp_path / 'run'), start=start, stop=np.datetime64(stop, 'ns'))
    assert_same(buffer, fed(chosen))
    assert buffer.lookup('base', 'lidar', start).z == 0.5


def test_window_is_as_long_as_asked_for(tmp_path):
    buffer = open_bag(write_ros2(tmp_path / 'run', RUN), cache_time=SECOND)
    odometry = next(edge for edge in buffer.edges() if edge.child == 'base')
    assert SECOND - PERIOD <= odometry.span <= SECOND + PERIOD


def test_latched_topics_are_static_whatever_their_name(tmp_path):
    mounted = [Message(START, '/mounts', [('base', 'gps', 77, (1, 2, 3, 0, 0, 0, 1))], LATCHED)]
    for path in (write_ros2(tmp_path / 'run', RUN + mounted),
                 write_ros1(tmp_path / 'run.bag', RUN + mounted),
                 as_mcap(tmp_path / 'run.bag')):
        assert open_bag(path).lookup('base', 'gps', START + SECOND).y == 2.0


@pytest.mark.parametrize('converted', [lambda path: path, as_mcap], ids=['bag', 'mcap'])
def test_arrivals_are_what_was_recorded(tmp_path, converted):
    path = converted(write_ros1(tmp_path / 'run.bag',
                                driving(count=3, publisher='/drive') + STATIC))
    arrivals = list(read_messages(path))
    assert [arrival.received for arrival in arrivals] == sorted(
        arrival.received for arrival in arrivals)
    assert {(arrival.connection.topic, arrival.connection.static, arrival.connection.latched,
             arrival.connection.publisher) for arrival in arrivals} == {
        ('/tf', False, False, '/drive'), ('/tf_static', True, True, '/somebody')}
    only = list(read_messages(path, ['/tf'], start=START + PERIOD, stop=START + 2 * PERIOD))
    assert len(only) == 2


def test_recording_pickles_and_copies_with_what_is_known_of_it(tmp_path):
    buffer = open_bag(write_ros2(tmp_path / 'run', RUN))
    for again in pickle.loads(pickle.dumps(buffer)), copy.copy(buffer):
        assert_same(again, buffer)
        assert (again.path, again.oddities, again.statistics) == (
            buffer.path, buffer.oddities, buffer.statistics)


WITHOUT = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in ('rosbags', 'rich', 'rclpy'):
            raise ModuleNotFoundError(f'no {name}', name=name)

sys.meta_path.insert(0, Blocker())
from tf_tree_py import BufferCore, load
from tf_tree_py.bag import BagError, open_bag
BufferCore().save('some.tftree')
print(load('some.tftree'))
for read in lambda: open_bag('some.mcap'), lambda: BufferCore().record('some.mcap'):
    try:
        read()
    except BagError as error:
        print(error)
"""


def test_without_rosbags_one_sentence_says_what_to_install(tmp_path):
    done = subprocess.run([sys.executable, '-c', WITHOUT], cwd=tmp_path, capture_output=True,
                          text=True, timeout=PATIENCE_S, check=False,
                          env={**os.environ, 'PYTHONPATH': str(REPOSITORY)})
    assert done.returncode == 0, done.stderr
    first, *others = done.stdout.splitlines()
    assert first == '<Snapshot: empty>'
    assert len(others) == 2
    assert all('needs rosbags' in line and 'pip install rosbags' in line
               for line in others)
    assert [path.name for path in tmp_path.iterdir()] == ['some.tftree']


def test_missing_module_of_the_package_itself_is_not_blamed_on_rosbags():
    error = ModuleNotFoundError('No module', name='tf_tree_py.bag.files.file_formats')
    with pytest.raises(ModuleNotFoundError) as raised:
        needs_extra(error)
    assert raised.value is error
