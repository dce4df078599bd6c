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

"""The last seconds of what arrived become a bag: of all that a doctor needs to see."""

from contextlib import suppress
import json

from bags import START
import pytest
from tf_tree_py.bag import Bag, Decoder, open_bag
from tf_tree_py.core import BufferCore, Pose, TransformException
from tf_tree_py.core.arrivals.received import Received
from tf_tree_py.core.arrivals.sample import Batch
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.flight_recorder import FlightRecorder, Happened, LOOKUP_FAILED

SECOND = 10**9
ASKED = Happened('asked', 'by a test')


class Robot:
    """Sends ten times a second into a buffer that a recorder watches."""

    def __init__(self, folder, **options):
        self.heard = []
        self.recorder = FlightRecorder(
            folder, last=2 * SECOND, notify=lambda *told: self.heard.append(told),
            **{'every': 10 * SECOND, **options})
        self.buffer = BufferCore()
        self.buffer.observers.add(self.recorder)

    def send(self, begin, end, edges=(('map', 'base'), ('base', 'base')), static=False):
        for tick in range(round((end - begin) * 10)):
            stamp = START + round(begin * SECOND) + tick * SECOND // 10
            batch = Batch(list(edges), [stamp] * len(edges), [pack_pose(*Pose())] * len(edges))
            self.buffer.observers.tell_received(
                Received(batch, stamp + 5_000_000, '/tf', static))
            self.buffer.insert_batch(batch, '', static)


def test_bag_has_the_last_seconds_and_all_that_is_static(tmp_path):
    robot = Robot(tmp_path / 'new' / 'folder')
    robot.send(0.0, 0.1, [('base', 'lidar')], static=True)
    robot.send(0.0, 9.0)
    path = robot.recorder.write(ASKED)
    assert robot.heard == [(ASKED, path, '')]
    again = open_bag(path)
    assert {(edge.child, edge.static) for edge in again.edges()} == {
        ('base', False), ('lidar', True)}
    base, = (edge for edge in again.edges() if edge.child == 'base')
    assert (base.oldest, base.latest) == (START + 6_900_000_000, START + 8_900_000_000)


def test_refused_transforms_and_times_of_arrival_are_in_the_bag(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 1.0)
    with_self_edges = list(Bag(robot.recorder.write(ASKED)).arrivals())
    assert Decoder().read(with_self_edges[0]).edges == (('map', 'base'), ('base', 'base'))
    assert with_self_edges[0].received == START + 5_000_000


def test_what_happened_stands_beside_the_bag_and_in_it(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 1.0)
    path = robot.recorder.write(Happened('loop', 'a -> b', 5, ('a', 'b'), [{'code': 'loop'}]))
    assert path.name.endswith('_loop.mcap')
    story = json.loads(path.with_suffix('.json').read_text())
    assert story == {'why': 'loop', 'summary': 'a -> b', 'stamp': 5, 'frames': ['a', 'b'],
                     'findings': [{'code': 'loop'}], 'bag': path.name, 'messages': 10}
    assert b'a -> b' in path.read_bytes()


def test_at_most_one_in_a_while_and_so_many_files(tmp_path):
    robot = Robot(tmp_path, keep=2)
    paths = []
    for number in range(4):
        robot.send(number * 20.0, number * 20.0 + 1.0)
        paths.append(robot.recorder.write(ASKED))
        assert robot.recorder.write(ASKED) is None
        assert robot.heard[-1][2] == 'the last one was too short ago'
    assert sorted(tmp_path.iterdir()) == sorted(
        each for path in paths[2:] for each in (path, path.with_suffix('.json')))


def test_jump_back_leaves_nothing_of_the_time_before(tmp_path):
    robot = Robot(tmp_path)
    robot.send(50.0, 51.0)
    robot.send(0.0, 1.0)
    base, = open_bag(robot.recorder.write(ASKED)).edges()
    assert base.latest == START + 900_000_000


@pytest.mark.parametrize('prepare, why_not', [
    (lambda robot, folder: None, 'nothing has arrived'),
    (lambda robot, folder: (robot.send(0.0, 1.0), folder.write_text('')), 'File exists')])
def test_why_nothing_was_written_is_told(tmp_path, prepare, why_not):
    robot = Robot(tmp_path / 'folder')
    prepare(robot, tmp_path / 'folder')
    assert robot.recorder.write(ASKED) is None
    assert why_not in robot.heard[-1][2]


def test_first_lookup_that_fails_after_it_worked_writes_once(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 3.0)
    lookups = [('map', 'nowhere', START), ('map', 'base', START + SECOND),
               ('map', 'base', START + 60 * SECOND), ('map', 'base', START + 60 * SECOND)]
    for lookup in lookups:
        with suppress(TransformException):
            robot.buffer.lookup(*lookup)
    robot.recorder.close()
    (happened, path, _), = robot.heard
    assert (happened.why, happened.frames) == (LOOKUP_FAILED, ('map', 'base'))
    assert 'extrapolation into the future' in happened.summary
    assert open_bag(path).frames()
