# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Helpers of a fleet's tests, without ROS: routers of Zenoh, robots, and waits."""

from contextlib import contextmanager
from glob import glob
import json
import os
from pathlib import Path
from queue import SimpleQueue
import signal
import socket
import subprocess
import sys
import time

from conditions import until
from tf_tree_py.core import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.fleet import configuration, open_session
from tf_tree_py.fleet.keys import RMW_TYPE, TYPE_HASH
import zenoh
from zenoh import ext

PATIENCE_S = 30.0
SECOND = 1_000_000_000

_ROUTER = """
import sys, zenoh
config = zenoh.Config.from_json5(sys.argv[1])
session = zenoh.open(config)
print('up', flush=True)
sys.stdin.read()
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def port_of(endpoint):
    return int(endpoint.rpartition(':')[2])


# A router would search for half a second before it is open, although it may not search.
AT_ONCE = {'delay': 1}


def router_config(endpoint, **more):
    return json.dumps({'mode': 'router', 'listen': {'endpoints': [endpoint]},
                       'scouting': {'multicast': {'enabled': False}, **AT_ONCE}, **more})


class Router:
    """A router in a separate process, which can be killed and restarted."""

    def __init__(self, protocol='tcp', **more):
        self.endpoint = f'{protocol}/127.0.0.1:{free_port()}'
        self._config = router_config(self.endpoint, **more)
        self.start()

    def start(self):
        self._process = subprocess.Popen(
            [sys.executable, '-c', _ROUTER, self._config], text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout.readline() == 'up\n'

    def hang(self):
        """Stop it, so that it answers nothing; its connections stay."""
        os.kill(self._process.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, self._process.pid, os.WSTOPPED)  # each of its threads has stopped

    def kill(self):
        """Kill it, also if it hangs."""
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()


@contextmanager
def router_here(protocol='tcp', endpoint=None, **more):
    """Run a router in this process; yield its endpoint."""
    endpoint = endpoint or f'{protocol}/127.0.0.1:{free_port()}'
    session = zenoh.open(zenoh.Config.from_json5(router_config(endpoint, **more)))
    try:
        yield endpoint
    finally:
        session.close()


@contextmanager
def session_at(endpoint, config=None):
    session = open_session(configuration(endpoint, config), PATIENCE_S)
    try:
        yield session
    finally:
        session.close()


def kept(session, key, data):
    """Publish transient-local data like bridges and rmw_zenoh; return the publisher."""
    publisher = ext.declare_advanced_publisher(
        session, key, cache=ext.CacheConfig(max_samples=1), publisher_detection=True,
        sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None))
    publisher.put(data)
    return publisher


class Visits:
    """Records which robots connect and disconnect, and waits for it."""

    def __init__(self):
        self._told = SimpleQueue()

    def __call__(self, robot, here):
        self._told.put((robot, here))

    def wait(self):
        return self._told.get(timeout=PATIENCE_S)

    def so_far(self):
        told = []
        while not self._told.empty():
            told.append(self._told.get())
        return told


def _sockets(protocol, state):
    """Yield the local and the remote addresses of this process's sockets, as the kernel does."""
    own = {os.readlink(path) for path in glob('/proc/self/fd/*') if os.path.islink(path)}
    for line in Path(f'/proc/self/net/{protocol}').read_text().splitlines()[1:]:
        fields = line.split()
        if fields[3] == state and f'socket:[{fields[9]}]' in own:
            yield fields[1], fields[2]


def listening():
    """Return where this process listens: address and port in the kernel's format, and the kind."""
    return {(*local.split(':'), protocol)
            for protocol, state in (('tcp', '0A'), ('tcp6', '0A'), ('udp', '07'), ('udp6', '07'))
            for local, _ in _sockets(protocol, state)}


def connections_to(endpoint):
    """Return how many TCP connections this process has to a port."""
    port = port_of(endpoint)
    return sum(int(remote.partition(':')[2], 16) == port for _, remote in _sockets('tcp', '01'))


def place(x):
    return (float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def message(*edges, stamp=None):
    """Return a TFMessage of (parent, child, x), by default with the current stamp."""
    stamp = time.time_ns() if stamp is None else stamp
    return write([Sample(parent, child, stamp, place(x)) for parent, child, x in edges])


def x_of(buffer, target, source):
    return buffer.lookup_within(PATIENCE_S, target, source).x


def rmw_token(zid, robot, topic):
    """Return the token of a publisher, as rmw_zenoh declares it."""
    return (f'@ros2_lv/0/{zid}/0/10/MP/%/%{robot}/driver/%{robot}%{topic}/{RMW_TYPE}/{TYPE_HASH}/'
            '::,1:,:,:,,')


def robot_of(listener, name):
    return next((one for one in listener.robots() if one.name == name), None)


def send_first(listener, robot, data):
    """
    Send a robot's first message, and wait until the listener has counted it.

    If it was sent before the robot knew of the listener's subscription, the listener gets it from
    the robot's cache only as long as no later message has arrived (docs/fleet.md).
    """
    robot.send(data)
    until(lambda: (known := robot_of(listener, robot.robot)) and known.transforms + known.refused)
