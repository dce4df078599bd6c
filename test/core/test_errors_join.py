# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The classes of tf2_py catch our exceptions, whenever tf2_py is imported."""

import subprocess
import sys
import textwrap

from programs import PATIENCE_S
import pytest

# The classes of tf2_py, as its C++ code creates them: without attributes of their own.
TF2_PY = """
import sys, types

def make_tf2_py():
    module = types.ModuleType('tf2_py')
    module.TransformException = type('TransformException', (Exception,), {})
    for name in ('Connectivity', 'Lookup', 'Extrapolation', 'InvalidArgument', 'Timeout'):
        setattr(module, name + 'Exception',
                type(name + 'Exception', (module.TransformException,), {}))
    sys.modules['tf2_py'] = module
    return module
"""

CAUGHT = """
import copy, pickle
from tf_tree_py.core import errors

PAIRS = {
    'ClockJumpException': 'ExtrapolationException',
    'ArgumentTypeException': 'InvalidArgumentException',
    'ConnectivityException': 'ConnectivityException',
    'ExtrapolationException': 'ExtrapolationException',
    'FutureExtrapolationException': 'ExtrapolationException',
    'InvalidArgumentException': 'InvalidArgumentException',
    'LookupException': 'LookupException',
    'NoDataException': 'ExtrapolationException',
    'PastExtrapolationException': 'ExtrapolationException',
    'TimeoutException': 'TimeoutException',
    'TransformException': 'TransformException',
}

def check(tf2_py):
    for name, theirs in PAIRS.items():
        kind = getattr(errors, name)
        for catcher in (getattr(tf2_py, theirs), tf2_py.TransformException, kind,
                        errors.TransformException):
            try:
                raise kind('gone', hint='Look')
            except catcher as error:
                assert type(error) is kind
                assert str(error) == 'gone.\\nLook'
                for again in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
                    assert type(again) is kind and vars(again) == vars(error)
        for other in set(PAIRS.values()) - {theirs, 'TransformException'}:
            assert not issubclass(kind, getattr(tf2_py, other))
"""


def run(code):
    """Run a program in which no exception has been created yet."""
    return subprocess.run([sys.executable, '-c', TF2_PY + textwrap.dedent(code)],
                          capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def assert_runs(code):
    done = run(code)
    assert done.returncode == 0, done.stderr


def test_classes_of_a_tf2_that_was_imported_before_catch_ours():
    assert_runs('tf2_py = make_tf2_py()\n' + CAUGHT + """
# Before any is made, too.
assert issubclass(errors.TimeoutException, tf2_py.TimeoutException)
check(tf2_py)
assert errors.LookupException.__bases__ == (errors.TransformException, tf2_py.LookupException)
""")


def test_classes_of_a_tf2_that_was_imported_later_catch_ours():
    assert_runs(CAUGHT + """
before = errors.LookupException('made before')
tf2_py = make_tf2_py()
check(tf2_py)
# Then one that was made before, too.
assert isinstance(before, tf2_py.LookupException)
""")


def test_tf2_is_not_imported_and_without_it_nothing_changes():
    assert_runs(CAUGHT + """
import tf_tree_py
check(errors)
assert 'tf2_py' not in sys.modules
assert errors.LookupException.__mro__ == (
    errors.LookupException, errors.TransformException, errors.JoinableException,
    Exception, BaseException, object)
""")


def test_classes_of_the_dropin_are_ours():
    assert_runs(CAUGHT + """
tf2_py = types.ModuleType('tf2_py')
for name in PAIRS.values():
    setattr(tf2_py, name, getattr(errors, name))
sys.modules['tf2_py'] = tf2_py
check(tf2_py)
assert errors.LookupException.__bases__ == (errors.TransformException,)
""")


def test_tf2_that_is_being_imported_is_met_again_when_it_is_there():
    assert_runs(CAUGHT + """
half = sys.modules['tf2_py'] = types.ModuleType('tf2_py')
errors.LookupException('made meanwhile')
half.TransformException = type('TransformException', (Exception,), {})
errors.LookupException('made meanwhile')
assert not issubclass(errors.LookupException, half.TransformException)
check(make_tf2_py())
""")


def test_something_else_of_that_name_does_no_harm():
    assert_runs(CAUGHT + """
tf2_py = make_tf2_py()
for name in PAIRS.values():
    setattr(tf2_py, name, 'no class')
check(errors)
""")


@pytest.mark.parametrize('bases', [
    'tf2_py.LookupException, errors.LookupException',
    'errors.LookupException, tf2_py.LookupException'])
def test_program_that_joined_them_by_itself_goes_on(bases):
    assert_runs(CAUGHT + f"""
tf2_py = make_tf2_py()
class Both({bases}):
    pass
for catcher in (tf2_py.TransformException, errors.LookupException):
    try:
        raise Both('gone')
    except catcher as error:
        assert str(error) == 'gone'
""")


def test_many_threads_may_be_the_first():
    assert_runs(CAUGHT + """
import threading
sys.setswitchinterval(1e-6)
tf2_py = make_tf2_py()
barrier = threading.Barrier(8)
wrong = []

def fail():
    barrier.wait()
    for _ in range(50):
        try:
            raise errors.FutureExtrapolationException('gone')
        except tf2_py.ExtrapolationException:
            pass
        except BaseException as error:
            wrong.append(error)

threads = [threading.Thread(target=fail) for _ in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert not wrong, wrong
check(tf2_py)
""")
