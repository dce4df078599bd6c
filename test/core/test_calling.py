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

import pytest
from tf_tree_py.core.calling import call_all


def test_everything_is_called_in_order_and_the_first_error_raised():
    called = []

    def call(number, error=None):
        called.append(number)
        if error is not None:
            raise error

    with pytest.raises(SystemExit):
        call_all([lambda: call(1), lambda: call(2, SystemExit()), lambda: call(3, ValueError()),
                  lambda: call(4)])
    assert called == [1, 2, 3, 4]
    call_all([])
