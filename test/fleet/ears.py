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

"""Somebody who hears a robot over Zenoh, as a program without this package would."""

import threading

from programs import PATIENCE_S
from tf_tree_py.core.arrivals import wire
from tf_tree_py.fleet import configuration, open_session
import zenoh.ext


class Ears:
    """Keeps the samples of all messages under some keys, in the order in which they came."""

    def __init__(self, address, keys):
        self._heard, self._came = [], threading.Condition(threading.RLock())
        self._session = open_session(configuration(address), PATIENCE_S)
        self._subscriber = zenoh.ext.declare_advanced_subscriber(
            self._session, keys, self._hear,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
            recovery=zenoh.ext.RecoveryConfig(heartbeat=True))

    def _hear(self, sample):
        with self._came:
            self._heard.append((str(sample.key_expr),
                                wire.read(sample.payload.to_bytes()).samples()))
            self._came.notify_all()

    def messages(self, key):
        with self._came:
            return [samples for heard, samples in self._heard if heard == key]

    def wait_for(self, key, arrived):
        """Return the messages under a key as soon as they are as they should be."""
        with self._came:
            assert self._came.wait_for(lambda: arrived(self.messages(key)), PATIENCE_S), (
                self.messages(key))
            return self.messages(key)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._session.close()
