# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The texts of errors and hints, and the line that a warning names."""

import _thread
import inspect
import threading
import warnings

import pytest
from tf_tree_py.core import (
    ExtrapolationException,
    FutureExtrapolationException,
    LookupException,
    NoDataException,
    PastExtrapolationException,
)
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.errors import ANY_STRUCTURE, no_truth, TransformException, warn
from tf_tree_py.core.hints import no_sample, unknown_frame
from tf_tree_py.core.text import (
    known_names,
    listed,
    LONGEST_TEXT,
    nearest,
    printable,
    shorten,
)

SECOND = 1_000_000_000


# --- text


def test_text_loses_its_middle_only_if_it_is_too_long():
    assert shorten('abcdef', 6) == 'abcdef'
    assert shorten('abcdefg', 6) == 'abc... (7 characters) ...efg'
    assert shorten('abcdefg', 5) == 'ab... (7 characters) ...fg'
    assert shorten('abcdefg', 0) == '... (7 characters) ...'
    assert shorten('x' * 4000) == 'x' * 4000
    assert shorten('x' * 4001) == 'x' * 2000 + '... (4001 characters) ...' + 'x' * 2000
    assert LONGEST_TEXT == 4000


def test_control_characters_are_escaped():
    assert printable('a b\n\x1b[0m\u2028gr\u00fcn\x00') == (
        'a b\\n\\x1b[0m\\u2028gr\u00fcn\\x00')


def test_list_names_the_first_and_counts_the_others():
    names = ['a', 'b', 'c', 'd', 'e']
    assert listed([]) == ''
    assert listed(names) == 'a, b, c, d, e'
    assert listed([*names, 'f']) == 'a, b, c, d, e and 1 more'
    assert listed(names, most=2) == 'a, b and 3 more'
    assert listed(['x' * 80, 'y' * 81]) == (
        f'{"x" * 80}, {"y" * 40}... (81 characters) ...{"y" * 40}')
    assert listed(['abcdef'], longest=4) == 'ab... (6 characters) ...ef'


def test_nearest_name_is_the_most_similar():
    assert nearest('base_link', ['base_lin', 'base_linka', 'base_link_', 'bas']) == 'base_linka'
    assert nearest('base_link', ['zebra', 'base_lonk', 'base_l']) == 'base_lonk'
    assert nearest('base_link', iter(['zebra'])) is None
    assert nearest('base_link', []) is None


def test_long_names_and_those_after_a_thousand_are_not_compared():
    longest, longer = 'x' * 200, 'x' * 201
    assert nearest(longest, ['x' * 199]) == 'x' * 199
    assert nearest(longer, ['x' * 199]) is None
    assert nearest('x' * 199, [longest]) == longest
    assert nearest('x' * 199, [longer]) is None
    others = [f'{number:03d}' for number in range(999)]
    assert nearest('map_', [*others, 'map']) == 'map'
    assert nearest('map_', [*others, '999', 'map']) is None


@pytest.mark.parametrize(('name', 'names', 'hint'), [
    ('zebra', ('map', 'odom'), 'Known: map, odom'),
    ('odmo', ('map', 'odom'), "Did you mean 'odom'? Known: odom, map"),
    ('CAM', ('map', 'left_cam_optical_frame'),
     "Did you mean 'left_cam_optical_frame'? Known: left_cam_optical_frame, map"),
    ('cam', ('map', 'left_cam_optical_frame', 'right_cam_of_robot'),
     "2 frames have 'cam' in their names. Known: right_cam_of_robot, left_cam_optical_frame, map"),
    ('ca', ('map', 'left_cam_optical_frame'), 'Known: map, left_cam_optical_frame'),
    ('camera', ('map', 'front_left_camera', 'cameras'),
     "Did you mean 'cameras'? Known: cameras, front_left_camera, map"),
    ('x' * 200, ('map', 'x' * 300), f"Did you mean {'x' * 300!r}? Known: {'x' * 300}, map"),
    ('x' * 201, ('map', 'x' * 300), f"Known: map, {'x' * 300}"),
    ('zebra', tuple('ABCDEFGHIJKL'), 'Known: A, B, C, D, E, F, G, H, I, J, K, L'),
    ('zebra', tuple('ABCDEFGHIJKLM'),
     'Known: A, B, C, D, E, F, G, H, I, J, K, L and 1 more (frames() lists all)'),
], ids=range(10))
def test_unknown_name_is_answered_with_the_known_ones(name, names, hint):
    assert known_names(name, names) == hint
    assert unknown_frame(name, iter(names), 'Wait')(True) == hint
    assert unknown_frame(name, [], 'Wait')(True) == 'Wait'
    assert unknown_frame(name, [], 'Wait')(False) == 'The buffer is empty'


# --- errors


def error_at(stamp, cache_time=10 * SECOND, oldest=95 * SECOND, live=False):
    error = no_sample('map', 'base', stamp, oldest, 100 * SECOND, cache_time)
    error.in_lookup('a', 'b', live)
    assert vars(error).items() >= {
        'parent': 'map', 'child': 'base', 'requested': stamp, 'oldest': oldest,
        'latest': 100 * SECOND, 'target_frame': 'a', 'source_frame': 'b'}.items()
    return type(error), error.hint


NO_NEWER = ('This edge has no newer sample: look up an earlier stamp. stamps_at_rate returns '
            'stamps for which all edges have data')
NO_OLDER = ('This edge has no older sample: look up a later stamp. stamps_at_rate returns stamps '
            'for which all edges have data')
EXPIRED = ('The buffer keeps 10.000 s: use a longer cache_time (UNLIMITED keeps everything)')
ENDED = ('The edge had ended at that time: it was silent, and another edge reversed it; tf_doctor '
         'names the publishers of both')


@pytest.mark.parametrize(('stamp', 'oldest', 'kind', 'hint'), [
    (100 * SECOND + 1, 95, FutureExtrapolationException, NO_NEWER),
    (100 * SECOND, 95, ExtrapolationException, ENDED),
    (95 * SECOND, 95, ExtrapolationException, ENDED),
    (95 * SECOND - 1, 95, PastExtrapolationException, NO_OLDER),
    (90 * SECOND, 95, PastExtrapolationException, NO_OLDER),
    (90 * SECOND - 1, 95, PastExtrapolationException, EXPIRED),
    (90 * SECOND - 1, 85, PastExtrapolationException, EXPIRED),
    (98, 95, PastExtrapolationException, 'Stamps are nanoseconds, and 98 would fit if it were '
     f'seconds: tf_tree_py.from_seconds(98). {EXPIRED}'),
], ids=range(8))
def test_error_of_an_edge_is_of_the_side_on_which_it_has_no_sample(stamp, oldest, kind, hint):
    assert error_at(stamp, oldest=oldest * SECOND) == (kind, hint)


@pytest.mark.parametrize(('stamp', 'hint'), [
    (101 * SECOND, 'Use a timeout that is long enough for the data to arrive. If this is the '
     "present time, pass the stamp of the sensor's own message instead"),
    (101 * SECOND + 1, 'Use a timeout that is long enough for the data to arrive. If this is the '
     "present time, pass the stamp of the sensor's own message instead. This edge has no samples "
     'in that interval: tf_doctor reports whether it is late, silent, or stamped by another '
     'clock'),
    (94 * SECOND, 'No older sample of this edge has arrived: its publisher or the listener '
     'started later'),
    (89 * SECOND, 'The buffer keeps 10.000 s: look up sooner, or use a longer cache_time '
     '(UNLIMITED keeps everything)'),
], ids=range(4))
def test_hint_of_a_live_buffer_says_how_to_get_the_data(stamp, hint):
    assert error_at(stamp, live=True)[1] == hint


def test_error_of_an_edge_without_samples_has_no_stamps_but_the_requested():
    for oldest, newest in ((None, None), (5, None), (None, 5)):
        error = no_sample('map', 'base', 7, oldest, newest, SECOND)
        assert type(error) is NoDataException
        assert (error.parent, error.child, error.requested) == (None, 'base', 7)
        assert (error.oldest, error.latest, error.hint) == (None, None, '')


def test_text_of_an_error_is_shortened_part_by_part():
    long = 'x' * 5000
    short = shorten(long)
    error = LookupException(long, 7, hint=long)
    assert error.args == (short, 7)
    error = NoDataException(child=long, requested=1, hint=lambda live: long)
    error.waited_s = 1.25
    assert str(error) == f'{shorten(error.describe())} (waited 1.250 s for it).\n{short}'
    assert error.describe() == (
        f'Unable to lookup transform, cache is empty: no data for the edge above frame [{long}]')
    assert repr(LookupException('gone')) == "LookupException('gone')"


def test_hint_is_made_once_and_knows_whether_data_may_arrive():
    asked = []
    error = LookupException('gone', hint=lambda live: asked.append(live) or f'live: {live}')
    error.in_lookup('a', 'b', True)
    assert (error.hint, error.hint, asked) == ('live: True', 'live: True', [True])
    assert TransformException('gone', hint=lambda live: f'live: {live}').hint == 'live: False'


def test_facts_of_an_error_are_those_that_it_was_given():
    error = ExtrapolationException('gone', parent='map', child='base', requested=1, oldest=2,
                                   latest=3, hint='Wait', blocked_on=ANY_STRUCTURE)
    assert (error.parent, error.child, error.requested, error.oldest, error.latest) == (
        'map', 'base', 1, 2, 3)
    assert (error.hint, error.blocked_on) == ('Wait', ((None, 0),))
    assert str(error) == 'Lookup would require extrapolation, the edge map -> base.\nWait'
    error.target_frame, error.source_frame = 'a', 'b'
    assert error.describe() == (
        'Lookup would require extrapolation, the edge map -> base, when looking up transform from '
        'frame [b] to frame [a]')
    error = LookupException('gone', target_frame='a', source_frame='b', blocked_on=())
    assert (error.target_frame, error.source_frame, error.blocked_on) == ('a', 'b', ())


def test_thing_with_a_length_has_no_truth_value():
    with pytest.raises(TypeError, match=r'^list has no truth value: compare it with None, or use '
                                        r'len\(\)$'):
        no_truth([1])


# --- warnings


def program(name=None, file=None):
    """Return a function of another module, which calls what it is given, and then another."""
    names = {key: value for key, value in (('__name__', name), ('__file__', file)) if value}
    source = 'def call(function, argument, then=list):\n function(argument)\n then()'
    exec(compile(source, 'other.py', 'exec'), names)
    return names['call']


def place_of(function, *arguments):
    """Return the only warning of a call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        function(*arguments)
    (warning,) = caught
    assert str(warning.message) == 'look'
    return warning


def test_warning_is_at_the_line_that_called_the_package():
    warning = place_of(warn, 'look', DeprecationWarning)
    assert warning.filename == __file__
    assert warning.category is DeprecationWarning
    assert warning.lineno == place_of.__code__.co_firstlineno + 4
    assert place_of(warn, 'look').category is UserWarning


@pytest.mark.parametrize(('name', 'file', 'passed_over'), [
    ('rclpy.executors', None, True), ('rclpy', '/opt/rclpy/__init__.py', True),
    ('importlib._bootstrap', None, True), ('program', '/home/program.py', False),
    (None, None, False), ('my_rclpy.executors', None, False), ('executors.rclpy', None, False),
    ('helper', inspect.getsourcefile(warn), True),
])
def test_warning_is_not_at_a_line_of_a_library_in_between(name, file, passed_over):
    warning = place_of(program(name, file), warn, 'look')
    assert warning.filename == (__file__ if passed_over else 'other.py')


def test_warning_in_a_thread_without_another_caller_is_at_its_first_line():
    ended = threading.Event()

    def wait():
        _thread.start_new_thread(program('rclpy.executors'), (warn, 'look', ended.set))
        assert ended.wait(60)

    assert place_of(wait).filename == 'other.py'


def test_warning_is_given_once_for_each_line_where_python_says_so():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('default')
        for _ in range(3):
            warn('look again')
        warn('look again')
    assert len(caught) == 2
    assert caught[1].lineno == caught[0].lineno + 1


# --- closing


def test_closable_closes_itself_at_its_end():
    class Thing(Closable):
        closed = 0

        def close(self):
            self.closed += 1

    with Thing() as thing:
        assert type(thing) is Thing
        assert not thing.closed
    assert thing.closed == 1
    with pytest.raises(ValueError, match='inside'), thing:
        raise ValueError('inside')
    assert thing.closed == 2
    with pytest.raises(NotImplementedError):
        Closable().close()
