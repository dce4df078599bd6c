"""What a robot sends reaches whoever listens, whenever the router is there."""

from contextlib import closing
import queue

from programs import PATIENCE_S
import pytest
from routers import Ears, Router
from tf_tree_py.core import Sample
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.fleet import configuration, FleetError
from tf_tree_py.fleet.uplink import Uplink

MOVING, STATIC = 'robot7/tf', 'robot7/tf_static'
CAMERA = Sample('base', 'camera', 0, (0.25, *IDENTITY[1:]))


def at(stamp):
    return Sample('odom', 'base', stamp, (float(stamp), *IDENTITY[1:]))


class Log:
    """What was told, line by line, each with how bad it is."""

    def __init__(self):
        self._lines = queue.SimpleQueue()

    def info(self, message):
        self._lines.put(('info', message))

    def warning(self, message):
        self._lines.put(('warning', message))

    def line(self):
        return self._lines.get(timeout=PATIENCE_S)

    def is_empty(self):
        return self._lines.empty()


def uplink(router, log):
    return closing(Uplink(configuration(router.address), 'robot7', log))


def test_who_comes_late_hears_the_last_statics_and_what_moved_lately():
    log = Log()
    with Router() as router, uplink(router, log) as robot:
        assert log.line() == ('info', f'connected to {router.address}')
        robot.send_static([CAMERA])
        robot.send_static([CAMERA, at(0)])
        for stamp in (1, 2):
            robot.send([at(stamp)])
        with Ears(router.address, 'robot7/*') as ears:
            ears.wait_for(MOVING, lambda messages: messages == [[at(1)], [at(2)]])
            robot.send([at(3), CAMERA])
            ears.wait_for(MOVING, lambda messages: messages[-1] == [at(3), CAMERA])
            assert ears.messages(STATIC) == [[CAMERA, at(0)]]
    assert log.is_empty(), 'the end is told to nobody'


def test_router_that_comes_late_gets_the_statics_of_before():
    log, router = Log(), Router()
    with uplink(router, log) as robot:
        robot.send_static([CAMERA])
        robot.send([at(1)])
        kind, line = log.line()
        assert kind == 'warning'
        assert line.startswith(f'no connection to {router.address} yet, and trying on: ')
        with router, Ears(router.address, 'robot7/*') as ears:
            assert ears.wait_for(STATIC, len) == [[CAMERA]]
            assert log.line() == ('info', f'connected to {router.address}')


def test_router_that_goes_costs_one_line_each_way_and_nothing_that_is_kept():
    log, router = Log(), Router().start()
    with uplink(router, log) as robot:
        assert log.line() == ('info', f'connected to {router.address}')
        robot.send([at(1)])
        router.stop()
        assert log.line() == ('warning', f'lost the connection to {router.address}, and trying on')
        robot.send([at(2)])
        robot.send_static([CAMERA])
        with router:
            assert log.line() == ('info', f'connected to {router.address}')
            with Ears(router.address, 'robot7/*') as ears:
                ears.wait_for(MOVING, lambda messages: messages == [[at(1)], [at(2)]])
                ears.wait_for(STATIC, lambda messages: messages == [[CAMERA]])
            assert log.is_empty()


def test_uplink_that_never_came_up_ends():
    with uplink(Router(), Log()) as robot:
        robot.send_static([CAMERA])


def test_names_that_no_key_can_have_are_refused():
    with pytest.raises(FleetError, match=r"'\*' cannot be the name of a robot"):
        Uplink(configuration('tcp/127.0.0.1:1'), '*', Log())
