# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limits of a doctor, and its report about a tree, as data."""

from argparse import Namespace
from collections import Counter
from collections.abc import Sequence
from typing import Any

from tf_tree_py.command.arguments import add_number, Parser
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds

from .inputs import nothing_arrived, TreeInput

VERSION = 1
"""The version of a report; it changes only if a key is removed or gets another meaning."""


def add_limits(parser: Parser) -> None:
    """Add the arguments for ``limits_of``."""
    limits = Thresholds()
    group = parser.add_argument_group('limits')
    for name, value, text in (
            ('--max-delay', limits.max_delay / 1e9, 'from a stamp to its arrival, s'),
            ('--max-skew', limits.max_skew / 1e9, 'between the ages of edges on a path, s'),
            ('--cache-time', limits.cache_time / 1e9, 'history of the buffers in the system, s')):
        add_number(group, name, value, text)
    for name, step, usual, text in (
            ('--max-speed', limits.max_speed, limits.max_usual_speed, 'of a frame in its parent, '
             'm/s'),
            ('--max-turn-rate', limits.max_turn_rate, limits.max_usual_turn_rate, 'likewise, '
             'rad/s')):
        add_number(group, name, None, f'{text}; {step:g} for a single step and {usual:g} for an '
                   'edge all the time, unless given')


def limits_of(arguments: Namespace) -> Thresholds:
    """Return the limits of the arguments of ``add_limits``."""
    usual = Thresholds()
    return Thresholds(
        from_seconds(arguments.cache_time), arguments.max_speed or usual.max_speed,
        arguments.max_turn_rate or usual.max_turn_rate, from_seconds(arguments.max_delay),
        from_seconds(arguments.max_skew), arguments.max_speed or usual.max_usual_speed,
        arguments.max_turn_rate or usual.max_usual_turn_rate)


def judged(tree_input: TreeInput, doctor: Doctor,
           interrupted: bool = False) -> tuple[dict[str, Any], list[Finding]]:
    """
    Return the report about an input that was watched, and its findings, the worst first.

    :param interrupted: whether the watch was shorter than requested.
    :raises Cannot: no transform has arrived.
    """
    findings = tree_input.findings(doctor)
    if not doctor.transforms and not any(one.severity is Severity.ERROR for one in findings):
        raise nothing_arrived(tree_input)
    return _report(tree_input, doctor, findings, interrupted), findings


def _report(tree_input: TreeInput, doctor: Doctor, findings: Sequence[Finding],
            interrupted: bool) -> dict[str, Any]:
    counts = Counter(finding.severity for finding in findings)
    return {
        'version': VERSION,
        'source': tree_input.name,
        'watched_s': doctor.watched / 1e9,
        'interrupted': interrupted,
        'transforms': doctor.transforms,
        'frames': len(tree_input.buffer.frames()),
        'damage': tree_input.damage(),
        **{f'{severity.value}s': counts[severity] for severity in Severity},
        'findings': [finding.as_dict() for finding in findings],
    }
