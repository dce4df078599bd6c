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

"""What a robot sends reaches whoever listens, whenever the router is there."""

from contextlib import closing

from ears import Ears
from fleet_helpers import free_port, Router, router_here, until
import pytest
from tf_tree_py.core import Sample
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.fleet import FleetError
from tf_tree_py.fleet.uplink import Uplink

MOVING, STATIC = 'robot7/tf', 'robot7/tf_static'
CAMERA = Sample('base', 'camera', 0, (0.25, *IDENTITY[1:]))


def at(stamp):
    return Sample('odom', 'base', stamp, (float(stamp), *IDENTITY[1:]))


def uplink(endpoint):
    return closing(Uplink(endpoint, 'robot7'))


def test_who_comes_late_hears_the_last_statics_and_what_moved_lately(caplog):
    with router_here() as router, uplink(router) as robot, Ears(router, 'robot7/*') as early:
        robot.send_static([CAMERA])
        early.wait_for(STATIC, lambda messages: messages == [[CAMERA]])
        robot.send_static([CAMERA, at(0)])
        for stamp in (1, 2):
            robot.send([at(stamp)])
        with Ears(router, 'robot7/*') as late:
            late.wait_for(MOVING, lambda messages: messages == [[at(1)], [at(2)]])
            robot.send([at(3), CAMERA])
            late.wait_for(MOVING, lambda messages: messages[-1] == [at(3), CAMERA])
            assert late.messages(STATIC) == [[CAMERA, at(0)]]
    assert not caplog.records, 'nothing was wrong'


def test_router_that_comes_late_gets_the_statics_of_before(caplog):
    endpoint = f'tcp/127.0.0.1:{free_port()}'
    with uplink(endpoint) as robot:
        robot.send_static([CAMERA])
        robot.send([at(1)])
        until(lambda: caplog.records)
        with router_here(endpoint=endpoint), Ears(endpoint, 'robot7/*') as ears:
            assert ears.wait_for(STATIC, len) == [[CAMERA]]


def test_router_that_died_comes_back_to_what_was_sent_meanwhile(caplog):
    router = Router()
    with uplink(router.endpoint) as robot:
        robot.send_static([CAMERA])
        with Ears(router.endpoint, 'robot7/*') as ears:
            ears.wait_for(STATIC, len)
        robot.send([at(1)])
        router.kill()
        until(lambda: 'is lost' in caplog.text)
        robot.send([at(2)])
        robot.send_static([CAMERA, at(0)])
        router.start()
        with Ears(router.endpoint, 'robot7/*') as ears:
            ears.wait_for(MOVING, lambda messages: messages == [[at(1)], [at(2)]])
            ears.wait_for(STATIC, lambda messages: messages == [[CAMERA, at(0)]])
        assert len(caplog.records) == 2, 'one line each way'
        router.kill()


def test_uplink_that_never_came_up_ends():
    with uplink('tcp/127.0.0.1:9') as robot:
        robot.send_static([CAMERA])


@pytest.mark.parametrize(('connect', 'robot', 'sentence'), [
    ('tcp/127.0.0.1:9', '*', r"'\*' cannot be the name of a robot"),
    ('hall', 'robot7', 'no address of a router'),
    (None, 'robot7', 'nothing to connect to'),
])
def test_wrong_arguments_are_named_at_once(connect, robot, sentence):
    with pytest.raises(FleetError, match=sentence):
        Uplink(connect, robot)
