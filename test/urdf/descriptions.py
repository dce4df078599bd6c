# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Robot descriptions for tests: with every kind of joint, and with many random joints."""

import random

from tf_tree_py.urdf import Robot


def joint(name, type_, parent, child, inside='', xyz='0 0 0', rpy='0 0 0', axis=None):
    """Return a joint as URDF."""
    axis = '' if axis is None else f'<axis xyz="{axis}"/>'
    return (f'<joint name="{name}" type="{type_}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/>{axis}{inside}</joint>')


def robot(*joints, links=None):
    """Return a description of joints, each on a separate line, with the links that they name."""
    if links is None:
        links = dict.fromkeys(word.split('"')[0] for text in joints
                              for word in text.split('link="')[1:])
    return '\n'.join(['<robot name="r">', *(f'<link name="{link}"/>' for link in links), *joints,
                      '</robot>'])


def parsed(*joints, **options):
    return Robot.parse(robot(*joints, **options))


def chain(count):
    """Return a robot with a serial chain of joints, which rotate about various axes."""
    axes = ['0 0 1', '0 1 0', '1 0 0', '1 -2 0.5']
    return robot(*(joint(f'joint_{number}', 'revolute', f'link_{number}', f'link_{number + 1}',
                         xyz='0.1 0 0.05', rpy='0.1 -0.2 0.3', axis=axes[number % 4])
                   for number in range(count)))


def at_random(seed, count=40):
    """Return a robot with random joints of every kind, in a random tree; some mimic."""
    dice = random.Random(seed)
    types = ['fixed', 'revolute', 'continuous', 'prismatic', 'planar', 'floating']
    types += dice.choices(['fixed', 'revolute', 'continuous', 'prismatic'], k=count - len(types))
    dice.shuffle(types)
    joints, leaders = [], []
    for number, type_ in enumerate(types):
        inside = ''
        if type_ in ('revolute', 'prismatic', 'continuous'):
            if leaders and dice.random() < 0.4:
                inside = (f'<mimic joint="{dice.choice(leaders)}" '
                          f'multiplier="{dice.uniform(-2, 2)}" offset="{dice.uniform(-1, 1)}"/>')
            leaders.append(f'j{number}')
        if type_ in ('revolute', 'prismatic'):
            inside += '<limit lower="-9" upper="9" effort="1" velocity="1"/>'
        axis = '0 0 1' if type_ == 'planar' else _vector(dice, 1.0)
        joints.append(joint(f'j{number}', type_, f'l{dice.randint(0, number)}', f'l{number + 1}',
                            inside, _vector(dice, 2.0), _vector(dice, 3.0), axis))
    return robot(*joints)


def _vector(dice, size):
    return ' '.join(repr(dice.uniform(-size, size)) for _ in range(3))
