# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a doctor has found, for tests."""

from tf_tree_py.health.checks.finding import Severity


def only(findings):
    """Return the only one of some findings."""
    findings = list(findings)
    codes = [(finding.code, finding.edges) for finding in findings]
    assert len(findings) == 1, f'there should be one finding, and there are {codes}'
    return findings[0]


def worth_reporting(robot, doctor=None):
    """Return a doctor's findings about a robot, except notes."""
    return [finding for finding in robot.findings(doctor)
            if finding.severity is not Severity.NOTE]
