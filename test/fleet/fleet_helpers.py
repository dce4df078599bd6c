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

"""Routers of Zenoh, robots, and what a fleet's tests wait with: no ROS, and nobody sleeps."""

from contextlib import contextmanager
from glob import glob
import json
import os
from pathlib import Path
from queue import SimpleQueue
import socket
import subprocess
import sys
import time

from tf_tree_py.core import Sample
from tf_tree_py.core.arrivals.wire import write
from tf_tree_py.fleet import configuration, open_session
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


def router_config(endpoint, **more):
    return json.dumps({'mode': 'router', 'listen': {'endpoints': [endpoint]},
                       'scouting': {'multicast': {'enabled': False}}, **more})


class Router:
    """A router in a process of its own, which may die and come back."""

    def __init__(self, protocol='tcp', **more):
        self.endpoint = f'{protocol}/127.0.0.1:{free_port()}'
        self._config = router_config(self.endpoint, **more)
        self.start()

    def start(self):
        self._process = subprocess.Popen(
            [sys.executable, '-c', _ROUTER, self._config], text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._process.stdout.readline() == 'up\n'

    def kill(self):
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
    """Send as bridges and rmw_zenoh do what is transient local; return what keeps it."""
    publisher = ext.declare_advanced_publisher(
        session, key, cache=ext.CacheConfig(max_samples=1), publisher_detection=True,
        sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None))
    publisher.put(data)
    return publisher


class Visits:
    """Hears which robots come and go, and waits for that."""

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


def listening():
    """Return on which addresses this process listens, as the kernel writes them, and how."""
    own = {os.readlink(path) for path in glob('/proc/self/fd/*') if os.path.islink(path)}
    found = set()
    for kind, state in (('tcp', '0A'), ('tcp6', '0A'), ('udp', '07'), ('udp6', '07')):
        for line in Path(f'/proc/self/net/{kind}').read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == state and f'socket:[{fields[9]}]' in own:
                found.add((fields[1].partition(':')[0], kind))
    return found


def place(x):
    return (float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def message(*edges, stamp=None):
    """Return a TFMessage of (parent, child, x), all of now unless said otherwise."""
    stamp = time.time_ns() if stamp is None else stamp
    return write([Sample(parent, child, stamp, place(x)) for parent, child, x in edges])


def x_of(buffer, target, source):
    return buffer.lookup_within(PATIENCE_S, target, source).x


def until(true, what='it'):
    """Wait until something holds that no event tells of."""
    end = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end, f'{what} did not happen'
        time.sleep(0.01)
