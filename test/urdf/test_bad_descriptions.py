# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors in descriptions name the line, the joint, and the fix."""

import os
import pickle
import subprocess
import sys

from descriptions import joint, parsed, robot
from programs import PATIENCE_S
import pytest
from tf_tree_py.core import Pose
from tf_tree_py.urdf import DescriptionError, Robot
from tf_tree_py.urdf.xacro_files import description_of

J = joint('j', 'revolute', 'a', 'b')
FIXED = joint('f', 'fixed', 'b', 'c')


def described(*joints, **options):
    return robot(*joints, **options)


# Links are in the lines from 2 on, and joints in the lines after them.
BAD = {
    'two roots': (
        described(J, links='abx'), 1, "2 links have no parent: 'a' (line 2), 'x' (line 4)",
        'make each of the others the child of a joint'),
    'a loop': (
        described(J, joint('k', 'fixed', 'd', 'c'), joint('l', 'fixed', 'c', 'd')), 7,
        "joint 'k': it is part of a loop, which has no root: 'k' (line 7), "
        "'l' (line 8)", 'reverse one of these joints'),
    'nothing but a loop': (
        described(J, joint('k', 'fixed', 'b', 'a')), 4, "joint 'j': it is part of a loop",
        'reverse one of these joints'),
    'a joint on itself': (
        described(joint('j', 'fixed', 'a', 'a')), 3, 'it is part of a loop', 'or remove it'),
    'a missing link': (
        described(J, joint('k', 'fixed', 'base_lnk', 'c'), links=['a', 'b', 'c', 'base_link']), 7,
        "joint 'k': its parent 'base_lnk' is not a link", "did you mean 'base_link'?"),
    'a missing child link': (
        described(joint('j', 'fixed', 'a', 'b'), links='a'), 3,
        "its child 'b' is not a link", 'add <link name="b"/>'),
    'two parents': (
        described(J, joint('k', 'fixed', 'c', 'b')), 6,
        "joint 'k': its child 'b' already has a parent, through the joint 'j'",
        'remove one of the two'),
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
        "joint 'k': it mimics 'jj', but no joint has that name", "did you mean 'j'?"),
    'a mimic of what is fixed': (
        described(joint('k', 'revolute', 'a', 'b', '<mimic joint="f"/>'), FIXED), 5,
        "it mimics 'f', which is fixed", 'revolute, continuous or prismatic'),
    'a mimic that is planar': (
        described(J, joint('k', 'planar', 'b', 'c', '<mimic joint="j"/>')), 6,
        'it mimics another joint, but it is planar', 'only a joint with one variable can follow'),
    'mimics of each other': (
        described(joint('j', 'revolute', 'a', 'b', '<mimic joint="k"/>'),
                  joint('k', 'revolute', 'b', 'c', '<mimic joint="j"/>')), 5,
        "it mimics itself: 'j' -> 'k' -> 'j'", 'so that one joint leads'),
    'a word for a number': (
        described(joint('j', 'fixed', 'a', 'b', xyz='1 x 3')), 4,
        "joint 'j': <origin> has the xyz '1 x 3', and 'x' is not a number", 'such as 0.25'),
    'too few numbers': (
        described(joint('j', 'fixed', 'a', 'b', rpy='1 2')), 4, "<origin> has the rpy '1 2'",
        'write 3 numbers'),
    'infinity': (described(joint('j', 'fixed', 'a', 'b', xyz='inf 0 0')), 4,
                 "'inf' is not a number", 'a finite number'),
    "Python's number": (described(joint('j', 'fixed', 'a', 'b', xyz='1_0 0 0')), 4,
                        "'1_0' is not a number", 'a finite number'),
    'a macro in a number': (described(joint('j', 'fixed', 'a', 'b', xyz='${l} 0 0')), 4,
                            "'${l}' is not a number", 'xacro'),
    'a mimic that is too fast': (
        described(J, joint('k', 'revolute', 'b', 'c', '<mimic joint="j" multiplier="1e308"/>')), 6,
        "its multiplier with respect to 'j' is 1e+308, which is larger than 1e+09",
        'of a real mechanism'),
    'a mimic that is too fast by way of another': (
        described(J, joint('k', 'revolute', 'b', 'c', '<mimic joint="j" multiplier="1e6"/>'),
                  joint('l', 'prismatic', 'c', 'd', '<mimic joint="k" multiplier="-1e6"/>')), 8,
        "its multiplier with respect to 'j' is -1e+12", 'of a real mechanism'),
    'a mimic by a word': (
        described(J, joint('k', 'revolute', 'b', 'c', '<mimic joint="j" offset="pi"/>')), 6,
        "<mimic> has the offset 'pi', and 'pi' is not a number", 'write a finite number'),
    'a kind that is none': (described(joint('j', 'revolut', 'a', 'b')), 4,
                            "joint 'j': it has the type 'revolut'", 'did you mean revolute?'),
    'no kind': (described('<joint name="j"><parent link="a"/><child link="b"/></joint>'), 4,
                '<joint> has no type', 'revolute, continuous'),
    'a joint without a name': (described('<joint type="fixed"/>', links='a'), 3,
                               '<joint> has no name', 'give every joint a unique name'),
    'two of one name': (described(J, joint('j', 'fixed', 'b', 'c')), 6,
                        'there is another joint with this name in line 5', 'rename'),
    'no links': (robot(links=''), 1, 'it has no links', '<link name="..."/>'),
    'no name': ('<robot/>', 1, '<robot> has no name', 'give the robot a name'),
    'version 1.1': ('<robot name="r" version="1.1"><link name="a"/></robot>', 1,
                    "<robot> has the version '1.1', but robot_state_publisher of Jazzy reads only "
                    '1.0', 'write version="1.0", or remove the attribute'),
    'a version of one number': ('<robot name="r" version="1"><link name="a"/></robot>', 1,
                                "the version '1'", 'write version="1.0"'),
    'another format': ('<sdf/>', 1, 'the outermost element is <sdf>', '<robot name="...">'),
    'not closed': ('<robot name="r">\n<link name="a">\n</robot>', 3, 'mismatched tag',
                   '<link> in line 2 is not closed'),
    'nothing': ('', 1, 'this is not valid XML: no element found', '<robot name='),
    'a macro': ('<robot name="r" xmlns:xacro="x">\n<xacro:property name="a"/></robot>', 2,
                '<xacro:property> is a macro', 'expand it first'),
}


@pytest.mark.parametrize(('text', 'line', 'problem', 'fix'), BAD.values(), ids=BAD)
def test_error_names_the_line_the_joint_and_the_mend(text, line, problem, fix):
    with pytest.raises(DescriptionError) as raised:
        Robot.parse(text, 'arm.urdf')
    error = raised.value
    assert error.line == line and str(error).startswith(f'arm.urdf, line {line}: ')
    assert problem in str(error) and fix in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize('attack', [
    '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>',
    '<!DOCTYPE r SYSTEM "http://127.0.0.1:9/r.dtd"><robot name="r"/>',
    '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>',
    '<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///etc/passwd"> %p;]><robot name="r"/>',
], ids=['file', 'network', 'many', 'parameter'])
def test_nothing_is_fetched_and_no_entity_is_expanded(attack):
    with pytest.raises(DescriptionError, match='there is a DOCTYPE.*remove it'):
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
    with pytest.raises(DescriptionError, match='line 2: this is not UTF-8'):
        Robot.load(path)
    with pytest.raises(OSError, match='nowhere'):
        Robot.load(tmp_path / 'nowhere.urdf')


def test_file_may_begin_with_a_mark_and_name_an_encoding(tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_text('<?xml version="1.0" encoding="latin-1"?>\n<robot name="r"><link name="ä"/>'
                    '</robot>', encoding='utf-8-sig')
    assert Robot.load(path).root == Robot.parse(path.read_bytes()).root == 'ä'


@pytest.mark.parametrize(('visual', 'warned'), {
    'a box without sides': ('<geometry>\n<box size="1 0 1"/></geometry>',
                            "line 3: link 'a': <box> has the size '1 0 1'"),
    'a cylinder without a length': ('<geometry><cylinder radius="1"/></geometry>',
                                    "line 2: link 'a': <cylinder> has no length"),
    'no shape': ('', "line 2: link 'a': <visual> has no geometry"),
    'a mesh without a name': ('<geometry><mesh filename=""/></geometry>',
                              "line 2: link 'a': <mesh> has no filename"),
    'a shape of a later version': ('<geometry>\n<capsule radius="1" length="1"/></geometry>',
                                   "line 3: link 'a': <capsule> is not a shape of URDF 1.0; "
                                   'write a <box>, a <cylinder>, a <sphere> or a <mesh>'),
    'a colour that is a word': ('<geometry><sphere radius="1"/></geometry>'
                                '<material name="m"><color rgba="red"/></material>',
                                "<color> has the rgba 'red'"),
}.values())
def test_what_transforms_do_not_need_is_a_warning(visual, warned):
    described = Robot.parse('<robot name="r">\n<link name="a"><visual>' + visual + '</visual>'
                            '<visual><geometry><sphere radius="1"/></geometry></visual></link>'
                            '</robot>', 'arm.urdf')
    warning, = described.warnings
    assert warning.startswith('arm.urdf, line ') and warned in warning
    assert len(described.links['a']) == 1


def test_same_flaw_of_two_shapes_in_one_line_is_one_warning():
    shape = '<visual><geometry><box/></geometry></visual>'
    text = f'<robot name="r">\n<link name="a">{shape}{shape}\n{shape}</link></robot>'
    assert [warning.partition(' link')[0] for warning in Robot.parse(text, 'arm.urdf').warnings
            ] == ['arm.urdf, line 2:', 'arm.urdf, line 3:']


@pytest.mark.parametrize('version', ['1.0', '1.00', '01.0', ' 1.0', '1.0.'])
def test_version_1_0_may_be_written_in_any_way_that_jazzy_reads(version):
    assert Robot.parse(f'<robot name="r" version="{version}"><link name="a"/></robot>').root == 'a'


IGNORED = 'which URDF 1.0 lacks and robot_state_publisher of Jazzy ignores, so '


@pytest.mark.parametrize(('attributes', 'yaw', 'end'), [
    ('quat_xyzw="0 0 2 0"', 0.0, 'there is no rotation; write rpy="0.0 0.0 3.141592654" instead'),
    ('quat_xyzw="0 0 0 0"', 0.0,
     'there is no rotation; write the rotation as rpy, radians, instead'),
    ('quat_xyzw="1e308 1e308 1e308 1e308"', 0.0, 'there is no rotation; write the rotation as'),
    ('quat_xyzw="west"', 0.0, 'there is no rotation; write the rotation as rpy'),
    ('quat_xyzw="0 0 1 0" rpy="0 0 0.5"', 0.5,
     'only the rpy beside it counts; remove quat_xyzw'),
])
def test_quaternion_is_ignored_as_in_jazzy_with_a_warning(attributes, yaw, end):
    origin = f'<origin xyz="1 0 0" {attributes}/>'
    shape = f'<visual>\n{origin}<geometry><sphere radius="1"/></geometry></visual>'
    described = Robot.parse(f'<robot name="r"><link name="a"/><link name="b">{shape}</link>\n'
                            '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>'
                            f'{origin}</joint></robot>', 'arm.urdf')
    expected = Pose.from_xyz_rpy(x=1.0, yaw=yaw)
    assert described.joints[0].origin == described.links['b'][0].origin == expected
    for warning, place in zip(described.warnings, ["line 3: joint 'j'", "line 2: link 'b'"],
                              strict=True):
        assert warning.startswith(f'arm.urdf, {place}: <origin> has a quat_xyzw, {IGNORED}{end}')


def test_white_space_before_the_declaration_is_a_warning_and_lines_stay():
    text = '\n  <?xml version="1.0"?>\n<robot name="r"><link name="a"/></robot>'
    for given in (text, text.encode()):
        warning, = Robot.parse(given, 'arm.urdf').warnings
        assert warning.startswith('arm.urdf, line 2: there is white space before <?xml')
    with pytest.raises(DescriptionError, match='line 4: this is not valid XML'):
        Robot.parse(text.replace('</robot>', '\n</robo>'), 'arm.urdf')
    assert Robot.parse(text.lstrip()).warnings == ()


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
LEG = XACRO + """<xacro:macro name="leg" params="side">
  <link name="$(arg prefix)${side}"/>
  <joint name="${side}" type="fixed">
    <parent link="a"/>
    <child link="$(arg prefix)${side}"/>
    <origin xyz="1 2 3"/>
  </joint>
</xacro:macro>
</robot>"""
BODY = XACRO + """<xacro:arg name="prefix" default=""/>
<xacro:include filename="leg.xacro"/>
<link name="a"/>
<xacro:leg side="left"/>
</robot>"""


@pytest.fixture
def xacro_files(tmp_path):
    pytest.importorskip('xacro', reason='pip install xacro')
    (tmp_path / 'leg.xacro').write_text(LEG)
    (tmp_path / 'body.xacro').write_text(BODY)
    return tmp_path


def test_xacro_takes_arguments_and_names_the_files_that_it_reads(xacro_files):
    body = xacro_files / 'body.xacro'
    assert list(Robot.load(body).links) == ['a', 'left']
    assert list(Robot.load(body, {'prefix': 'my_'}).links) == ['a', 'my_left']
    description = description_of(body)
    assert description.files == (body, xacro_files / 'leg.xacro')
    assert 'place' not in description.text
    with pytest.raises(DescriptionError, match='only a file that ends in .xacro'):
        description_of(__file__, {'prefix': 'my_'})


@pytest.mark.parametrize(('file', 'old', 'new', 'place', 'problem'), [
    ('leg.xacro', '1 2 3', '1 2 x', 'leg.xacro, line 7', "'x' is not a number"),
    ('leg.xacro', '1 2 3', '${reach} 2 3', 'leg.xacro, line 7', "name 'reach' is not defined"),
    ('leg.xacro', '</joint>', '</join>', 'leg.xacro, line 8',
     'this is not valid XML: mismatched tag'),
    ('body.xacro', 'side="left"', 'sid="left"', 'body.xacro, line 5', 'sid'),
    ('body.xacro', 'leg.xacro', 'arm.xacro', 'body.xacro, line 3', 'arm.xacro'),
    ('body.xacro', '<link name="a"/>', '<link/>', 'body.xacro, line 4', '<link> has no name'),
])
def test_error_of_a_xacro_names_the_right_file_and_line(
        xacro_files, file, old, new, place, problem):
    path = xacro_files / file
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(DescriptionError) as raised:
        Robot.load(xacro_files / 'body.xacro')
    assert place in str(raised.value) and problem in str(raised.value)


def test_xacro_expands_what_is_written_for_it(tmp_path):
    pytest.importorskip('xacro', reason='pip install xacro')
    path = tmp_path / 'arm.urdf.xacro'
    path.write_text("""<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
        <xacro:property name="reach" value="0.5"/><link name="a"/><link name="b"/>
        <joint name="j" type="fixed"><parent link="a"/><child link="b"/>
        <origin xyz="${2 * reach} 0 0"/></joint></robot>""")
    assert Robot.load(path).joints[0].origin.x == 1.0
    path.write_text(path.read_text().replace('reach"', 'rich"'))
    with pytest.raises(DescriptionError, match='arm.urdf.xacro, line [0-9]+: xacro: .*reach'):
        Robot.load(path)


def test_without_xacro_the_error_says_what_to_install(tmp_path):
    (tmp_path / 'arm.xacro').write_text('<robot/>')
    program = ('import sys; sys.modules["xacro"] = None\n'
               'from tf_tree_py.urdf import *\n'
               'try: Robot.load("arm.xacro")\n'
               'except DescriptionError as error: print(error)')
    # Where the package is not installed, the tests find it on their path.
    done = subprocess.run([sys.executable, '-c', program], cwd=tmp_path, text=True, check=True,
                          capture_output=True, timeout=PATIENCE_S,
                          env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.stdout == ('arm.xacro: the package xacro is not installed; '
                           'pip install xacro, or apt install ros-jazzy-xacro\n')
