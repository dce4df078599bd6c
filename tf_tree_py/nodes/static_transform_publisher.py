# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Publishes static transforms from a command line, like tf2's program, or from a file."""

from argparse import SUPPRESS
from collections.abc import Sequence
import secrets
import sys
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Header
from tf_tree_py.beyond.uncertainty.insertion import STATIC_COVARIANCE_TOPIC
from tf_tree_py.command.arguments import number, Parser
from tf_tree_py.ros.messages.convert import transform_message
from tf_tree_py.ros.messages.pose_covariances import pose_with_covariance_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster
from tf_tree_py.ros.topics.qos import static_qos

from .bad_input import BadInput
from .parameters import declare
from .running import run, spin
from .static_transforms import from_words, from_yaml, StaticTransform
from .static_words import ANGLES, FRAMES, QUATERNION, TRANSLATION

NAME = 'static_transform_publisher'

_USAGE = """\
static_transform_publisher [--x X] [--y Y] [--z Z]
           [--qx QX] [--qy QY] [--qz QZ] [--qw QW | --roll ROLL --pitch PITCH --yaw YAW]
           --frame-id PARENT --child-frame-id CHILD
       static_transform_publisher --yaml FILE"""

_DESCRIPTION = """\
Publishes transforms that never change on /tf_static, also to late subscribers.

The transform takes coordinates in the child frame to coordinates in the parent: it is
the pose of the child in the parent. Omitted values are 0, except that qw is 1."""

_EXAMPLES = (
    ('static_transform_publisher --x 0.25 --z 0.5 --pitch 0.26 --frame-id base_link '
     '--child-frame-id camera', 'one'),
    ('static_transform_publisher --yaml mounts.yaml', 'all of a file'),
)

_EPILOG = """\
A file for --yaml has one line for each transform, with the same keywords:

  transforms:
    - {frame_id: base_link, child_frame_id: camera, x: 0.25, z: 0.5, pitch: 0.26}
    - {frame_id: base_link, child_frame_id: lidar, z: 0.7, qz: 0.6, qw: 0.8,
       covariance: [1e-6, 1e-6, 1e-6, 3e-4, 3e-4, 3e-4]}

Numbers are decimal, such as 0.25 or 1e-3. YAML's other numbers, such as 1:30, which is 90,
and 010, which is 8, are refused, and so is a key that is given twice.

A covariance is six variances, of x, y, z and rotation about x, y, z, in metres^2 and
radians^2 (or all 36 numbers); a CovarianceListener takes them from /tf_static_covariance.

The old forms of tf2 still work, with a warning: X Y Z YAW PITCH ROLL PARENT CHILD (note
the order of the angles), and X Y Z QX QY QZ QW PARENT CHILD."""

_OLD_FORMS = {
    8: (*TRANSLATION, 'yaw', 'pitch', 'roll', *FRAMES),
    9: (*TRANSLATION, *QUATERNION, *FRAMES),
}
_OLD_FORM_WARNING = 'Old-style arguments are deprecated; see --help for new-style arguments'


class StaticTransformPublisher(Node):
    """Publishes transforms once, and keeps running for late subscribers."""

    def __init__(self, transforms: Sequence[StaticTransform], **node_options: Any) -> None:
        """
        Publish.

        :param transforms: at least one, each child once.
        :param node_options: the keyword arguments of rclpy's ``Node``.
        """
        # As in tf2, many of these nodes may run without explicit names.
        super().__init__(f'{NAME}_{secrets.token_hex(8)}', **node_options)
        declare(self, ())
        now = self.get_clock().now().to_msg()
        self._broadcaster = StaticTransformBroadcaster(self)
        # The sign of a quaternion is kept.
        self._broadcaster.sendTransform([
            TransformStamped(header=Header(stamp=now, frame_id=parent), child_frame_id=child,
                             transform=transform_message(pose))
            for parent, child, pose, _ in transforms])
        self._publish_covariances(now, [one for one in transforms if one.covariance is not None])
        self.get_logger().info('Spinning until stopped - publishing\n'
                               + '\n'.join(map(str, transforms)))

    def _publish_covariances(self, now: Time, transforms: Sequence[StaticTransform]) -> None:
        """Publish covariances on a separate topic, because a TFMessage has no field for them."""
        if not transforms:
            return
        self._covariances = self.create_publisher(
            Odometry, STATIC_COVARIANCE_TOPIC, static_qos(len(transforms)))
        for parent, child, pose, covariance in transforms:
            assert covariance is not None
            stamped = pose_with_covariance_stamped(parent, 0, pose, covariance)
            self._covariances.publish(Odometry(header=Header(stamp=now, frame_id=parent),
                                               child_frame_id=child, pose=stamped.pose))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = _parser()
    flags, positional = _split(parser.own_arguments(argv))
    words = vars(parser.parse_args(flags))
    path = words.pop('yaml', None)
    if path is not None and (words or positional):
        parser.error('--yaml cannot be combined with other arguments')
    if positional:
        if words:
            parser.error('cannot specify both new-style (flags) and old-style (arguments)')
        words = _old_words(parser, positional)
    try:
        transforms = [from_words(words)] if path is None else from_yaml(path)
    except BadInput as error:
        parser.error(str(error))
    return run(NAME, argv, lambda ended: work(ended, transforms, bool(positional)))


def work(ended: Future, transforms: Sequence[StaticTransform], old_form: bool) -> None:
    """Publish transforms until a future is done."""
    node = StaticTransformPublisher(transforms)
    if old_form:
        node.get_logger().warning(_OLD_FORM_WARNING)
    spin(node, ended)


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES, epilog=_EPILOG, usage=_USAGE,
                    argument_default=SUPPRESS)
    for names, meaning in (
            (TRANSLATION, 'translation, metres'),
            (QUATERNION, 'rotation, a quaternion of any length but zero'),
            (ANGLES, 'rotation, radians: roll about x first, then pitch, then yaw')):
        for name in names:
            parser.add_argument(f'--{name}', type=number, metavar=name.upper(), help=meaning)
    parser.add_argument('--frame-id', metavar='PARENT', help='the parent frame')
    parser.add_argument('--child-frame-id', metavar='CHILD', help='the child frame')
    parser.add_argument('--yaml', metavar='FILE', help='a file of transforms, see below')
    return parser


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """
    Return the flags, each joined to its value, and the positional arguments.

    argparse would parse a negative number such as -1e-3 as a flag.
    """
    flags: list[str] = []
    positional: list[str] = []
    rest = iter(arguments)
    for argument in rest:
        if not argument.startswith('-') or _is_number(argument):
            positional.append(argument)
        elif argument in ('-h', '--help') or '=' in argument:
            flags.append(argument)
        else:
            value = next(rest, None)
            flags.append(argument if value is None else f'{argument}={value}')
    return flags, positional


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _old_words(parser: Parser, positional: Sequence[str]) -> dict[str, str]:
    names = _OLD_FORMS.get(len(positional))
    if names is None:
        parser.error(f'extra arguments that belong to no flag: {" ".join(positional)}')
    return dict(zip(names, positional, strict=True))


if __name__ == '__main__':
    sys.exit(main())
