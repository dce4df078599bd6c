# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The output of ``help(Buffer)`` is for its users."""

from tf_tree_py import Buffer, BufferCore, BufferInterface

FOR_THE_PACKAGE = {
    'alarm_clock', 'begin_feed', 'end_feed', 'fail_waiters', 'fed_by', 'forget_orphans',
    'leave_orphan', 'log_to', 'name_later', 'no_longer_fed_by', 'note', 'observe',
    'refuse', 'sleep_until_waited_for', 'unobserve', 'wake_everybody'}


def test_what_only_the_package_calls_is_not_here_but_in_objects_of_its_own():
    assert not {name.lstrip('_') for name in dir(Buffer)} & FOR_THE_PACKAGE


def test_whatever_is_public_says_what_it_does():
    undocumented = [name for name in dir(Buffer) if not name.startswith('_')
                    and not (getattr(Buffer, name).__doc__ or '').strip()]
    assert undocumented == []


def test_a_buffer_is_what_users_take_it_for_and_no_heap_of_parts():
    assert issubclass(Buffer, BufferCore) and issubclass(Buffer, BufferInterface)
    for kind in Buffer.__mro__:
        declared = vars(kind).get('__annotations__', {})
        assert declared.keys() <= vars(kind).keys(), f'{kind} declares what another class sets'
    # help() groups related methods: lookups of one pose, other lookups, the core's buffer,
    # tf2_py's methods, the interface that the client shares, tf2's buffer, object.
    assert len(Buffer.__mro__) <= 7
