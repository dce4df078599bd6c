# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The anchor's ``/diagnostics``: how far its edge is from the estimate, and its verdicts."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from tf_tree_py.beyond.corrections.anchor import AnchorEstimate, Remaining, Verdict
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.reports.switch_status import DIAGNOSTICS_TOPIC

# A blend that takes longer is a warning.
_LONG_S = 1.0

_OK, _WARN, _STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.STALE


class AnchorStatus:
    """Counts the verdicts of an anchor, and publishes them with the state of its edge."""

    def __init__(self, node: Node, edge: str) -> None:
        """
        Start without verdicts.

        :param edge: such as ``map -> odom``.
        """
        self._node, self._edge = node, edge
        self._counts = dict.fromkeys(('Accepted', 'Refused', 'Repeated', 'Relocalisations',
                                      'Jumps'), 0)
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS_TOPIC, 10)

    def count(self, verdict: Verdict) -> None:
        """Count a verdict."""
        self._counts['Repeated' if verdict.repeated else
                     'Accepted' if verdict.accepted else 'Refused'] += 1
        self._counts['Relocalisations'] += verdict.relocalised
        self._counts['Jumps'] += verdict.jump is not None

    def publish(self, held: AnchorEstimate | None, left: Remaining) -> None:
        """Publish the counts, how far the edge is from the estimate, and what that means."""
        level, message = _judged(held, left)
        values = {name: str(count) for name, count in self._counts.items()}
        values |= {'Distance to go (m)': f'{left.distance:.6f}',
                   'Angle to go (rad)': f'{left.angle:.6f}',
                   'Time to go (s)': f'{left.seconds:.6f}'}
        if held is not None:
            values['Newest accepted pose (s)'] = format_stamp(held.stamp)
        array = DiagnosticArray()
        array.header.stamp = self._node.get_clock().now().to_msg()
        array.status = [DiagnosticStatus(
            level=level, name=f'{self._node.get_name()}: {self._edge}', message=message,
            hardware_id=self._node.get_fully_qualified_name(),
            values=[KeyValue(key=key, value=value) for key, value in values.items()])]
        self._publisher.publish(array)


def _judged(held: AnchorEstimate | None, left: Remaining) -> tuple[bytes, str]:
    if held is None:
        return _STALE, 'no two poses have agreed yet, so nothing is published'
    if left.seconds > _LONG_S:
        return _WARN, f'the published edge is {way_to_go(left)} from the estimate'
    return _OK, 'the published edge is at the estimate, or less than a second from it'


def way_to_go(left: Remaining) -> str:
    """Return a distance, an angle and a time as text."""
    return f'{left.distance:.3g} m, {left.angle:.3g} rad and {left.seconds:.1f} s'
