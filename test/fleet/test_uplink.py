# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot's messages reach the listeners whenever the router is available."""

from contextlib import closing
import threading

from conditions import until
from ears import Ears
from fleet_helpers import free_port, Router, router_here
import pytest
from tf_tree_py.core import Sample
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.fleet import FleetError, RobotPublisher
from tf_tree_py.fleet.connection import Uplink

MOVING, STATIC = 'robot7/tf', 'robot7/tf_static'
CAMERA = Sample('base', 'camera', 0, (0.25, *IDENTITY[1:]))


def at(stamp):
    return Sample('odom', 'base', stamp, (float(stamp), *IDENTITY[1:]))


def names_of_threads():
    return [thread.name for thread in threading.enumerate()]


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
            late.wait_for(STATIC, lambda messages: messages == [[CAMERA, at(0)]])
    assert not caplog.records, 'nothing was wrong'


def test_router_that_comes_late_gets_the_statics_of_before(impatient, caplog):
    endpoint = f'tcp/127.0.0.1:{free_port()}'
    with uplink(endpoint) as robot:
        robot.send_static([CAMERA])
        robot.send([at(1)])
        until(lambda: caplog.records)
        with router_here(endpoint=endpoint), Ears(endpoint, 'robot7/*') as ears:
            assert ears.wait_for(STATIC, len) == [[CAMERA]]


def test_statics_of_before_do_not_hold_up_what_moves(impatient, monkeypatch):
    def send_slowly(publisher, data):
        robot.send([at(1)])  # as from another thread, while a slow link blocks this one
        send_static(publisher, data)

    send_static, endpoint = RobotPublisher.send_static, f'tcp/127.0.0.1:{free_port()}'
    with uplink(endpoint) as robot:
        robot.send_static([CAMERA])
        monkeypatch.setattr(RobotPublisher, 'send_static', send_slowly)
        with router_here(endpoint=endpoint), Ears(endpoint, 'robot7/*') as ears:
            assert ears.wait_for(STATIC, len) == [[CAMERA]]
            assert ears.wait_for(MOVING, len) == [[at(1)]]


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


def test_uplink_that_never_came_up_ends(impatient):
    with uplink('tcp/127.0.0.1:9') as robot:
        robot.send_static([CAMERA])
        assert 'uplink' in names_of_threads()
    assert 'uplink' not in names_of_threads()


@pytest.mark.parametrize(('connect', 'robot', 'sentence'), [
    ('tcp/127.0.0.1:9', '*', r"'\*' cannot be the name of a robot"),
    ('hall', 'robot7', 'not the address of a router'),
    (None, 'robot7', 'nothing to connect to'),
])
def test_wrong_arguments_are_named_at_once(connect, robot, sentence):
    with pytest.raises(FleetError, match=sentence):
        Uplink(connect, robot)
