# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The Python names of tf2's packages: the drop-in has them, and so do our packages."""

import json
from pathlib import Path
import sys

from programs import completed
import pytest
from standin import standin_env

PROGRAM = Path(__file__).with_name('surface.py')

CLASSES = ['Buffer', 'BufferClient', 'BufferCore', 'BufferInterface', 'ConvertRegistration',
           'NotImplementedException', 'StaticTransformBroadcaster', 'TransformBroadcaster',
           'TransformListener', 'TransformRegistration', 'TypeException']
FUNCTIONS = ['convert', 'Stamped']

# Names that programs do not take from tf2: Python's own, numpy, and a helper for Windows.
NOT_TF2S = {*sys.stdlib_module_names, 'numpy', 'rpyutils'}

# The names that are missing, and why.
NOT_IN_THE_DROPIN = {
    ('Buffer', 'jump_handle'): 'a buffer goes by several clocks, which come and go',
}
NOT_IN_OURS = NOT_IN_THE_DROPIN | {
    ('Buffer', 'lookupVelocityCore'): 'wrong where frames turn; lookup_twist is right',
    ('Buffer', 'lookupVelocityFullCore'): 'likewise',
    ('TransformListener', 'callback'): 'no message is made of what arrives',
    ('TransformListener', 'static_callback'): 'likewise',
    ('TransformListener', 'tf_sub'): 'the subscriptions are not on your node',
    ('TransformListener', 'tf_static_sub'): 'likewise',
    ('TransformListener', 'group'): 'likewise',
}
OTHER_PARAMETERS_IN_OURS = {
    ('TransformListener', None): 'spin_thread is True, and has another meaning',
}


def surface(*command, package, names=''):
    done = completed('python3', *command, str(PROGRAM), package, input=names, env=standin_env())
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope='module')
def theirs():
    return surface(package='tf2_ros')


@pytest.fixture(scope='module')
def dropin(theirs):
    names = json.dumps({module: list(found) for module, found in theirs['modules'].items()})
    return surface('-m', 'tf_tree_py.dropin', '--force', package='tf2_ros', names=names)


@pytest.fixture(scope='module')
def ours():
    return surface(package='tf_tree_py')


def is_tf2s(described):
    return described['home'].split('.')[0] not in NOT_TF2S


def test_every_name_of_every_module_is_in_the_dropin(theirs, dropin):
    missing = [f'{module}.{name}' for module, names in theirs['modules'].items()
               for name, described in names.items()
               if is_tf2s(described) and name not in dropin['modules'][module]]
    assert not missing


def test_what_comes_along_in_the_dropin_is_the_same_thing(theirs, dropin):
    others = [f'{module}.{name}' for module, names in theirs['modules'].items()
              for name, described in names.items()
              if is_tf2s(described) and not described['home'].startswith(('tf2_', '_tf2', 'tf2'))
              and described['home'] != dropin['modules'][module][name]['home']]
    assert not others


def members_of(kind, described, attributes):
    return {*described['members'], *attributes.get(kind, ())}


def test_classes_of_the_dropin_have_every_method_and_attribute(theirs, dropin):
    missing = {
        (kind, member) for kind in CLASSES
        for member in members_of(kind, theirs['modules']['tf2_ros'][kind], theirs['attributes'])
        - members_of(kind, dropin['modules']['tf2_ros'][kind], dropin['attributes'])}
    assert missing == set(NOT_IN_THE_DROPIN)


def test_our_classes_have_every_method_and_attribute(theirs, ours):
    missing = {
        (kind, member) for kind in CLASSES if kind != 'BufferCore'
        for member in members_of(kind, theirs['modules']['tf2_ros'][kind], theirs['attributes'])
        - members_of(kind, ours['package'][kind], ours['attributes'])}
    assert missing == set(NOT_IN_OURS)


def differing_calls(theirs, ours):
    """Yield the classes (None) or members whose parameters differ from tf2's."""
    for kind in CLASSES:
        described = theirs[kind]
        for member, wanted in [(None, described['parameters']), *described['members'].items()]:
            found = ours[kind]['parameters'] if member is None else (
                ours[kind]['members'].get(member))
            if None not in (wanted, found) and not is_callable_as(wanted, found):
                yield kind, member


def is_callable_as(wanted, found):
    """Return whether our additional parameters come last, and all are as optional as tf2's."""
    begin, more = found[:len(wanted)], found[len(wanted):]
    same = len(begin) == len(wanted) and all(
        ours[:2] == theirs[:2] and theirs[2] in (ours[2], 'required')
        for ours, theirs in zip(begin, wanted, strict=True))
    return same and all(
        default != 'required' or kind.startswith('VAR_') for _, kind, default in more)


def test_classes_of_the_dropin_are_called_as_those_of_tf2(theirs, dropin):
    assert not list(differing_calls(theirs['modules']['tf2_ros'], dropin['modules']['tf2_ros']))


def test_our_classes_are_called_as_those_of_tf2(theirs, ours):
    assert set(differing_calls(theirs['modules']['tf2_ros'], ours['package'])) == set(
        OTHER_PARAMETERS_IN_OURS)


@pytest.mark.parametrize('package', ['tf2_ros', 'tf2_geometry_msgs', 'tf2_sensor_msgs'])
def test_functions_of_the_dropin_are_called_as_those_of_tf2(theirs, dropin, package):
    differing = [
        name for name, described in theirs['modules'][package].items()
        if 'members' not in described and described['home'].startswith('tf2_')
        and described['parameters'] is not None
        and not is_callable_as(described['parameters'],
                               dropin['modules'][package][name]['parameters'])]
    assert not differing


def test_our_functions_are_called_as_those_of_tf2(theirs, ours):
    for name in FUNCTIONS:
        assert is_callable_as(theirs['modules']['tf2_ros'][name]['parameters'],
                              ours['package'][name]['parameters'])
