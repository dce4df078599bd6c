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

"""What is wrong with a fleet's connection as a whole; what a robot sends wrong is counted."""


class FleetError(Exception):
    """
    A fleet that cannot be heard or spoken to as it was asked for, in one sentence.

    Programs print it and end with the status 2.
    """


def sentence(error: Exception) -> str:
    """Return the text of an error of Zenoh in one line, without places in its source."""
    return ' '.join(str(error).partition(' at /')[0].split())
