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

"""What ``help(Buffer)`` shows is for those who use one."""

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
        assert declared.keys() <= vars(kind).keys(), 'it declares what another class sets'
    # help() shows together what belongs together: questions for one pose, other questions, the
    # core's buffer, tf2_py's methods, the interface that the client shares, tf2's buffer, object.
    assert len(Buffer.__mro__) <= 7
