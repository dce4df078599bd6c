# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import pytest
from tf_tree_py.core.buffer.waiting import call_all


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
