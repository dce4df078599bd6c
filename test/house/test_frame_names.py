# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Frame names with a prefix, and excluded edges."""

from hypothesis import given, strategies as st
import pytest
from tf_tree_py.frame_names import rename

names = st.text(min_size=1, max_size=8).filter(lambda name: not name.startswith('/'))


def test_names_stay_as_they_are_unless_something_is_asked_for():
    assert rename()('map', 'odom') == ('map', 'odom')
    assert rename()('/map', '/odom') == ('map', 'odom')
    assert rename()('//map', 'odom/') == ('/map', 'odom/')
    assert rename(shared_frames=['map'])('map', 'odom') == ('map', 'odom')


@pytest.mark.parametrize(('edge', 'renamed'), [
    (('odom', 'base'), ('r1/odom', 'r1/base')),
    (('map', 'odom'), ('map', 'r1/odom')),
    (('/map', '/odom'), ('map', 'r1/odom')),
    (('odom', 'r1/base'), ('r1/odom', 'r1/r1/base')),
])
@pytest.mark.parametrize('prefix', ['r1/', '/r1/'])
def test_prefix_goes_before_every_frame_that_is_not_shared(edge, renamed, prefix):
    assert rename(frame_prefix=prefix, shared_frames=['/map'])(*edge) == renamed


def test_frame_without_a_name_does_not_get_one():
    assert rename(frame_prefix='r1/')('', 'base') == ('', 'r1/base')
    assert rename(frame_prefix='r1/')('base', '/') == ('r1/base', '')


@pytest.mark.parametrize(('edge', 'renamed'), [
    (('r1/odom', 'r1/base'), ('odom', 'base')),
    (('/r1/odom', '/r1/base'), ('odom', 'base')),
    (('map', 'r1/odom'), ('map', 'odom')),
    (('r2/odom', 'r2/base'), None),
    (('r1/odom', 'r2/base'), None),
    (('earth', 'map'), None),
    (('r12/odom', 'r12/base'), None),
])
def test_prefix_is_taken_away_and_what_lacks_it_is_left_out(edge, renamed):
    assert rename(strip_frame_prefix='r1/', shared_frames=['map'])(*edge) == renamed


def test_one_prefix_may_take_the_place_of_another():
    exchange = rename(strip_frame_prefix='r1/', frame_prefix='robots/1/')
    assert exchange('r1/odom', 'r1/base') == ('robots/1/odom', 'robots/1/base')


@given(names, names, names)
def test_prefix_that_was_added_is_taken_away_again(parent, child, prefix):
    there, back = rename(frame_prefix=prefix), rename(strip_frame_prefix=prefix)
    assert back(*there(parent, child)) == (parent, child)


def test_filter_of_frames_keeps_the_edges_between_them():
    kept = rename(frame_filter=['map', '/odom', 'base'])
    assert kept('map', 'odom') == ('map', 'odom')
    assert kept('/odom', 'base') == ('odom', 'base')
    assert kept('base', 'camera') is None
    assert kept('earth', 'map') is None


def test_filter_function_judges_the_names_as_they_arrive():
    kept = rename(frame_filter=lambda parent, child: child == 'odom', frame_prefix='r1/')
    assert kept('map', '/odom') == ('r1/map', 'r1/odom')
    assert kept('odom', 'base') is None


def test_filter_of_nothing_keeps_nothing():
    assert rename(frame_filter=[])('map', 'odom') is None


@pytest.mark.parametrize('option', ['frame_filter', 'shared_frames'])
def test_one_name_where_several_belong_is_refused(option):
    with pytest.raises(ValueError, match=rf"{option} has to be .* such as \['map'\]"):
        rename(frame_prefix='r1/', **{option: 'map'})
