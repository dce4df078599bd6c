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

"""The QoS profiles of /tf and /tf_static, as tf2 has them, and of sensors."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

TF_TOPIC = '/tf'
TF_STATIC_TOPIC = '/tf_static'


def dynamic_qos() -> QoSProfile:
    """Return the profile of /tf, both sides: reliable, volatile, the last 100."""
    return QoSProfile(depth=100, history=HistoryPolicy.KEEP_LAST,
                      reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.VOLATILE)


def static_listener_qos() -> QoSProfile:
    """Return the subscriber's profile of /tf_static: a late joiner gets the last 100."""
    return _static_qos(100)


def static_broadcaster_qos() -> QoSProfile:
    """Return the publisher's: the last message only, as each holds everything ever sent."""
    return _static_qos(1)


def static_covariance_qos(count: int) -> QoSProfile:
    """Return the publisher's profile of covariances of static edges: a message for each."""
    return _static_qos(count)


def sensor_qos(depth: int = 10) -> QoSProfile:
    """Return a subscriber's profile that matches every publisher, best-effort sensors too."""
    return QoSProfile(depth=depth, history=HistoryPolicy.KEEP_LAST,
                      reliability=ReliabilityPolicy.BEST_EFFORT,
                      durability=DurabilityPolicy.VOLATILE)


def _static_qos(depth: int) -> QoSProfile:
    return QoSProfile(depth=depth, history=HistoryPolicy.KEEP_LAST,
                      reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)
