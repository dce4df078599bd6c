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

"""What a doctor is to mind, and what it says of a tree that it has watched, as data."""

from argparse import Namespace
from collections import Counter
from collections.abc import Sequence
from typing import Any

from tf_tree_py.core.checks.finding import Finding, Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.vitals.limits import Limits

from .arguments import add_number, Parser
from .source import nothing_arrived, TreeSource

VERSION = 1
"""Of the shape of a report; it changes only if a key goes or gets another meaning."""


def add_limits(parser: Parser) -> None:
    """Add the arguments for what ``limits_of`` makes of them."""
    limits = Limits()
    group = parser.add_argument_group('what is still right')
    for name, value, text in (
            ('--max-speed', limits.max_speed, 'of a frame in its parent, m/s'),
            ('--max-turn-rate', limits.max_turn_rate, 'likewise, rad/s'),
            ('--max-delay', limits.max_delay / 1e9, 'from a stamp to its arrival, s'),
            ('--max-skew', limits.max_skew / 1e9, 'between the ages of edges on a path, s'),
            ('--cache-time', limits.cache_time / 1e9, 'what the buffers of the system keep, s')):
        add_number(group, name, value, text)


def limits_of(arguments: Namespace) -> Limits:
    """Return what the arguments of ``add_limits`` say."""
    return Limits(from_seconds(arguments.cache_time), arguments.max_speed,
                  arguments.max_turn_rate, from_seconds(arguments.max_delay),
                  from_seconds(arguments.max_skew))


def judged(source: TreeSource, doctor: Doctor) -> tuple[dict[str, Any], list[Finding]]:
    """
    Return the report about a source that was watched, and its findings, the worst first.

    :raises Cannot: nothing has arrived.
    """
    doctor.endpoints = source.endpoints()
    findings = doctor.findings()
    if not findings and not doctor.transforms:
        raise nothing_arrived(source)
    return _report(source, doctor, findings), findings


def _report(source: TreeSource, doctor: Doctor, findings: Sequence[Finding]) -> dict[str, Any]:
    counts = Counter(finding.severity for finding in findings)
    return {
        'version': VERSION,
        'source': source.name,
        'watched_s': doctor.watched / 1e9,
        'transforms': doctor.transforms,
        'frames': len(source.buffer.frames()),
        'damage': source.damage(),
        **{f'{severity.value}s': counts[severity] for severity in Severity},
        'findings': [finding.as_dict() for finding in findings],
    }
