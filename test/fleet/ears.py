# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A receiver of a robot's messages over Zenoh, like a program without this package."""

import threading

from programs import PATIENCE_S
from tf_tree_py.core.messages import wire
from tf_tree_py.fleet import configuration, open_session
import zenoh.ext


class Ears:
    """Stores the samples of all messages under some keys, in the order of their arrival."""

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
        """Return the messages under a key as soon as a condition of them holds."""
        with self._came:
            assert self._came.wait_for(lambda: arrived(self.messages(key)), PATIENCE_S), (
                self.messages(key))
            return self.messages(key)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._session.close()
