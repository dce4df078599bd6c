# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Deprecated names work, and warn at the line that uses them."""

import sys
from types import ModuleType

import pytest
import tf_tree_py
from tf_tree_py.deprecation import deprecated, renamed, renamed_parameter


class Room:

    @deprecated('measure', until='0.3')
    def gauge(self, scale, *, offset=0):
        """Return a measurement."""
        return 10 * scale + offset


@pytest.fixture
def module():
    module = ModuleType('a_room_of_tests')
    module.measure = Room().gauge
    module.__getattr__ = renamed(module.__name__, {'gauge': 'measure'}, until='0.3')
    sys.modules[module.__name__] = module
    yield module
    del sys.modules[module.__name__]


def test_deprecated_method_works_and_warns_where_it_is_called():
    with pytest.warns(DeprecationWarning, match='Room.gauge is deprecated and will be removed '
                                                'in 0.3: use measure') as caught:
        assert Room().gauge(2, offset=1) == 21
    assert caught[0].filename == __file__
    assert Room.gauge.__doc__ == 'Return a measurement.'


def test_renamed_name_is_found_and_warns_where_it_is_used(module):
    with pytest.warns(DeprecationWarning, match=r'a_room_of_tests\.gauge is deprecated.*use '
                                                r'a_room_of_tests\.measure') as caught:
        assert module.gauge is module.measure
    assert caught[0].filename == __file__


def test_name_that_never_was_is_an_attribute_error(module):
    with pytest.raises(AttributeError, match="'a_room_of_tests' has no attribute 'gouge'"):
        module.gouge  # noqa: B018 - the lookup is the test


def test_old_name_of_the_top_level_package_is_found_like_one_of_any_module(monkeypatch):
    monkeypatch.setitem(tf_tree_py._OLD_NAMES, 'TreeCore', 'BufferCore')
    with pytest.warns(DeprecationWarning, match=r'tf_tree_py\.TreeCore is deprecated.*use '
                                                r'tf_tree_py\.BufferCore') as caught:
        from tf_tree_py import TreeCore
    assert TreeCore is tf_tree_py.BufferCore
    assert caught[0].filename == __file__
    assert 'TreeCore' not in dir(tf_tree_py)


@renamed_parameter('gap', 'longest_gap', until='0.3')
def holes(*, longest_gap=None):
    return longest_gap


def test_old_name_of_a_parameter_works_and_warns_where_it_is_given():
    with pytest.warns(DeprecationWarning, match=r'holes\(gap=\) is deprecated.*0.3: use '
                                                r'longest_gap=') as caught:
        assert holes(gap=3) == 3
    assert caught[0].filename == __file__
    assert holes(longest_gap=4) == 4
    with pytest.raises(TypeError, match='got gap and longest_gap'):
        holes(gap=1, longest_gap=2)


def test_name_that_moved_to_the_package_is_still_found_in_core():
    with pytest.warns(DeprecationWarning, match=r'tf_tree_py\.core\.BufferCore is deprecated.*'
                                                r'use tf_tree_py\.BufferCore') as caught:
        from tf_tree_py.core import BufferCore
    assert BufferCore is tf_tree_py.BufferCore
    assert caught[0].filename == __file__


@pytest.mark.parametrize('name', sorted(tf_tree_py._MOVED_FROM_CORE))
def test_every_name_that_moved_is_public_in_the_package(name):
    assert name in tf_tree_py.__all__
    assert name not in tf_tree_py.core.__all__
    with pytest.warns(DeprecationWarning, match=name):
        assert getattr(tf_tree_py.core, name) is getattr(tf_tree_py, name)


def test_name_that_never_was_in_core_is_an_attribute_error():
    with pytest.raises(AttributeError, match="'tf_tree_py.core' has no attribute 'Bufer'"):
        tf_tree_py.core.Bufer  # noqa: B018 - the lookup is the test
