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

"""Names of tf2_sensor_msgs, backed by tf_tree_py."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401

from . import tf2_sensor_msgs

__all__ = tf2_sensor_msgs.__all__
globals().update({name: getattr(tf2_sensor_msgs, name) for name in __all__})
