# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Goals and results of the ``LookupTransform`` action, and errors as codes in them.

Client and server have to agree on these, with each other and with tf2's.
"""


from action_msgs.msg import GoalStatus
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error
from tf_tree_py.core.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)

from ..messages.convert import time_message

ACTION_NAME = 'tf2_buffer_server'

_EXCEPTIONS: dict[int, type[TransformException]] = {
    TF2Error.LOOKUP_ERROR: LookupException,
    TF2Error.CONNECTIVITY_ERROR: ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: TimeoutException,
    # The base class: every other error.
    TF2Error.TRANSFORM_ERROR: TransformException,
}


def service_qos() -> QoSProfile:
    """
    Return the profile of the action's services.

    It is the standard profile of services with a greater depth. With the standard depth of
    10, ninety of a hundred requests or results at once would be lost.
    """
    return QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.VOLATILE)


def simple_goal(target_frame: str, source_frame: str, stamp: int) -> LookupTransform.Goal:
    """Return the goal for a lookup at one time, without a timeout."""
    return LookupTransform.Goal(target_frame=target_frame, source_frame=source_frame,
                                source_time=time_message(stamp))


def full_goal(target_frame: str, target_stamp: int, source_frame: str, source_stamp: int,
              fixed_frame: str) -> LookupTransform.Goal:
    """Return the goal for a lookup between two times, without a timeout."""
    goal = simple_goal(target_frame, source_frame, source_stamp)
    goal.target_time = time_message(target_stamp)
    goal.fixed_frame = fixed_frame
    goal.advanced = True
    return goal


def error_result(error: TransformException, timed_out: bool) -> LookupTransform.Result:
    """Return the result with the reason why there is no transform."""
    code = TF2Error.TIMEOUT_ERROR if timed_out else next(
        code for code, cls in _EXCEPTIONS.items() if isinstance(error, cls))
    return LookupTransform.Result(error=TF2Error(error=code, error_string=str(error)))


def is_unknown(status: int, result: LookupTransform.Result) -> bool:
    """Return whether a server reports that it does not have the goal."""
    # Other servers may omit the status; a transform with frame names is an answer.
    return bool(status == GoalStatus.STATUS_UNKNOWN and not result.transform.child_frame_id
                and result.error.error == TF2Error.NO_ERROR)


def transform_of(status: int, result: LookupTransform.Result) -> TransformStamped:
    """
    Return the transform of a result.

    :param status: of the goal. On a timeout tf2's server aborts the goal with an identity and no
        error, so that only the status shows it.
    :raises TransformException: of the class that the result names.
    """
    error = result.error
    if error.error != TF2Error.NO_ERROR:
        raise _EXCEPTIONS.get(error.error, TransformException)(error.error_string)
    if status == GoalStatus.STATUS_SUCCEEDED or result.transform.child_frame_id:
        return result.transform
    if status == GoalStatus.STATUS_ABORTED:
        raise TimeoutException('The buffer server did not find the transform in time')
    if status == GoalStatus.STATUS_CANCELED:
        raise TransformException('The lookup was canceled at the buffer server')
    raise TransformException(
        'The buffer server no longer knows the goal that it accepted: was it restarted?')
