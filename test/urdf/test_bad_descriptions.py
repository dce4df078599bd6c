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

"""What is wrong with a description is told: the line, the joint, and the mend."""

import os
import pickle
import subprocess
import sys

from descriptions import joint, parsed, robot
from programs import PATIENCE_S
import pytest
from tf_tree_py.urdf import DescriptionError, Robot

J = joint('j', 'revolute', 'a', 'b')
FIXED = joint('f', 'fixed', 'b', 'c')


def described(*joints, **options):
    return robot(*joints, **options)


# Links stand in the lines from 2 on, and joints in those behind them.
BAD = {
    'two roots': (
        described(J, links='abx'), 1, "2 links have no parent: 'a' (line 2), 'x' (line 4)",
        'hang the others on it'),
    'a loop': (
        described(J, joint('k', 'fixed', 'd', 'c'), joint('l', 'fixed', 'c', 'd')), 7,
        "joint 'k': it is part of a loop, so that no link is the uppermost: 'k' (line 7), "
        "'l' (line 8)", 'turn a joint round'),
    'nothing but a loop': (
        described(J, joint('k', 'fixed', 'b', 'a')), 4, "joint 'j': it is part of a loop",
        'turn a joint round'),
    'a joint on itself': (
        described(joint('j', 'fixed', 'a', 'a')), 3, 'it is part of a loop', 'take it out'),
    'a missing link': (
        described(J, joint('k', 'fixed', 'base_lnk', 'c'), links=['a', 'b', 'c', 'base_link']), 7,
        "joint 'k': its parent 'base_lnk' is no link", "did you mean 'base_link'?"),
    'a missing child link': (
        described(joint('j', 'fixed', 'a', 'b'), links='a'), 3,
        "its child 'b' is no link", 'add <link name="b"/>'),
    'two parents': (
        described(J, joint('k', 'fixed', 'c', 'b')), 6,
        "joint 'k': its child 'b' has a parent already, by the joint 'j'", 'take one of the two'),
    'no parent': (
        robot(J.replace('<parent link="a"/>', ''), links='ab'), 4, "joint 'j': it has no parent",
        'write <parent link="..."/>'),
    'an empty parent': (
        robot(J.replace('link="a"', 'link=""'), links='ab'), 4, 'has no link', '<parent link='),
    'a zero axis': (
        described(joint('j', 'prismatic', 'a', 'b', axis='0 0 0')), 4,
        "joint 'j': its axis is zero", 'xyz="0 0 1"'),
    'a mimic of nobody': (
        described(J, joint('k', 'revolute', 'b', 'c', '<mimic joint="jj"/>')), 6,
        "joint 'k': it mimics 'jj', and no joint has that name", "did you mean 'j'?"),
    'a mimic of what is fixed': (
        described(joint('k', 'revolute', 'a', 'b', '<mimic joint="f"/>'), FIXED), 5,
        "it mimics 'f', which is fixed", 'revolute, continuous or prismatic'),
    'a mimic that is planar': (
        described(J, joint('k', 'planar', 'b', 'c', '<mimic joint="j"/>')), 6,
        'it mimics, and is planar', 'only joints with one position'),
    'mimics of each other': (
        described(joint('j', 'revolute', 'a', 'b', '<mimic joint="k"/>'),
                  joint('k', 'revolute', 'b', 'c', '<mimic joint="j"/>')), 5,
        "it mimics itself: 'j' -> 'k' -> 'j'", 'somebody leads'),
    'a word for a number': (
        described(joint('j', 'fixed', 'a', 'b', xyz='1 x 3')), 4,
        "joint 'j': <origin> has the xyz '1 x 3', and 'x' is no number", 'such as 0.25'),
    'too few numbers': (
        described(joint('j', 'fixed', 'a', 'b', rpy='1 2')), 4, "<origin> has the rpy '1 2'",
        'it takes 3 numbers'),
    'infinity': (described(joint('j', 'fixed', 'a', 'b', xyz='inf 0 0')), 4,
                 "'inf' is no number", 'finite'),
    "Python's number": (described(joint('j', 'fixed', 'a', 'b', xyz='1_0 0 0')), 4,
                        "'1_0' is no number", 'finite'),
    'a macro in a number': (described(joint('j', 'fixed', 'a', 'b', xyz='${l} 0 0')), 4,
                            "'${l}' is no number", 'xacro'),
    'a mimic by a word': (
        described(J, joint('k', 'revolute', 'b', 'c', '<mimic joint="j" offset="pi"/>')), 6,
        "<mimic> has the offset 'pi', and 'pi' is no number", 'write a finite one'),
    'a kind that is none': (described(joint('j', 'revolut', 'a', 'b')), 4,
                            "joint 'j': it has the type 'revolut'", 'did you mean revolute?'),
    'no kind': (described('<joint name="j"><parent link="a"/><child link="b"/></joint>'), 4,
                '<joint> has no type', 'revolute, continuous'),
    'a joint without a name': (described('<joint type="fixed"/>', links='a'), 3,
                               '<joint> has no name', 'give every joint a name'),
    'two of one name': (described(J, joint('j', 'fixed', 'b', 'c')), 6,
                        'there is another joint of this name, in line 5', 'rename'),
    'no links': (robot(links=''), 1, 'it has no links', '<link name="..."/>'),
    'no name': ('<robot/>', 1, '<robot> has no name', 'give the robot one'),
    'another format': ('<sdf/>', 1, 'the outermost element is <sdf>', '<robot name="...">'),
    'not closed': ('<robot name="r">\n<link name="a">\n</robot>', 3, 'mismatched tag',
                   '<link> of line 2 is the last that was opened'),
    'nothing': ('', 1, 'this is no XML: no element found', '<robot name='),
    'a macro': ('<robot name="r" xmlns:xacro="x">\n<xacro:property name="a"/></robot>', 2,
                '<xacro:property> is a macro', 'expand it first'),
    'a box without sides': (
        '<robot name="r">\n<link name="a"><visual><geometry>\n<box size="1 0 1"/></geometry>'
        '</visual></link></robot>', 3, "link 'a': <box> has the size '1 0 1'",
        'a size is greater than zero'),
    'a visual without a shape': (
        '<robot name="r">\n<link name="a"><visual/></link></robot>', 2,
        "link 'a': <visual> has no geometry", 'take it out'),
}


@pytest.mark.parametrize(('text', 'line', 'problem', 'mend'), BAD.values(), ids=BAD)
def test_error_names_the_line_the_joint_and_the_mend(text, line, problem, mend):
    with pytest.raises(DescriptionError) as raised:
        Robot.parse(text, 'arm.urdf')
    error = raised.value
    assert error.line == line and str(error).startswith(f'arm.urdf, line {line}: ')
    assert problem in str(error) and mend in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize('attack', [
    '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>',
    '<!DOCTYPE r SYSTEM "http://127.0.0.1:9/r.dtd"><robot name="r"/>',
    '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>',
    '<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///etc/passwd"> %p;]><robot name="r"/>',
], ids=['file', 'network', 'many', 'parameter'])
def test_nothing_is_fetched_and_no_entity_is_expanded(attack):
    with pytest.raises(DescriptionError, match='there is a DOCTYPE.*take it out'):
        Robot.parse(attack)


def test_inclusion_is_not_followed():
    text = ('<robot name="r" xmlns:xi="http://www.w3.org/2001/XInclude"><link name="a"/>'
            '<xi:include href="/etc/passwd" parse="text"/></robot>')
    assert list(Robot.parse(text).links) == ['a']


def test_long_names_are_cut_and_deep_elements_are_read():
    with pytest.raises(DescriptionError) as raised:
        parsed(joint('j' * 10_000, 'fixed', 'a', 'b', xyz='1 ' * 50_000))
    assert len(str(raised.value)) < 1000
    deep = '<x>' * 20_000 + '</x>' * 20_000
    assert Robot.parse(f'<robot name="r"><link name="a"/>{deep}</robot>').root == 'a'


def test_file_that_is_no_text_or_not_there(tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_bytes(b'<robot name="r">\n\xff</robot>')
    with pytest.raises(DescriptionError, match='line 2: this is no UTF-8'):
        Robot.load(path)
    with pytest.raises(OSError, match='nowhere'):
        Robot.load(tmp_path / 'nowhere.urdf')


def test_file_may_begin_with_a_mark_and_name_an_encoding(tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_text('<?xml version="1.0" encoding="latin-1"?>\n<robot name="r"><link name="ä"/>'
                    '</robot>', encoding='utf-8-sig')
    assert Robot.load(path).root == Robot.parse(path.read_bytes()).root == 'ä'


def test_xacro_expands_what_is_written_for_it(tmp_path):
    pytest.importorskip('xacro', reason='pip install xacro')
    path = tmp_path / 'arm.urdf.xacro'
    path.write_text("""<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
        <xacro:property name="reach" value="0.5"/><link name="a"/><link name="b"/>
        <joint name="j" type="fixed"><parent link="a"/><child link="b"/>
        <origin xyz="${2 * reach} 0 0"/></joint></robot>""")
    assert Robot.load(path).joints[0].origin.x == 1.0
    path.write_text(path.read_text().replace('reach"', 'rich"'))
    with pytest.raises(DescriptionError, match='arm.urdf.xacro: xacro: .*reach'):
        Robot.load(path)


def test_without_xacro_the_error_says_what_to_install(tmp_path):
    (tmp_path / 'arm.xacro').write_text('<robot/>')
    program = ('import sys; sys.modules["xacro"] = None\n'
               'from tf_tree_py.urdf import *\n'
               'try: Robot.load("arm.xacro")\n'
               'except DescriptionError as error: print(error)')
    # Where the package is not installed, the tests find it by their path.
    done = subprocess.run([sys.executable, '-c', program], cwd=tmp_path, text=True, check=True,
                          capture_output=True, timeout=PATIENCE_S,
                          env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.stdout == ('arm.xacro: the package xacro is not installed; '
                           'pip install "tf_tree_py[xacro]", or apt install ros-jazzy-xacro\n')
