# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Small scenes for a doctor: the samples of some edges, and all that one check says about them."""

from operator import attrgetter

import numpy as np
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.doctor import Doctor

SECOND = 10**9
BEGIN = 1_700_000_000 * SECOND
SIMULATED = 100 * SECOND


def every(seconds, count, begin=0.0):
    """Return regular times, nanoseconds."""
    return from_seconds(begin) + from_seconds(seconds) * np.arange(count)


def after(*intervals):
    """Return the times after these intervals, seconds; the first one is 0."""
    return np.concatenate([[0], np.cumsum(from_seconds(np.array(intervals, float)))])


def poses(count, *, x=0.0, roll=0.0, yaw=0.0):
    """Return (N, 7) poses; each parameter is a number or one of N."""
    found = np.zeros((count, 7))
    found[:, 0] = x
    roll, yaw = 0.5 * np.asarray(roll, float), 0.5 * np.asarray(yaw, float)
    found[:, 3], found[:, 4] = np.sin(roll) * np.cos(yaw), np.sin(roll) * np.sin(yaw)
    found[:, 5], found[:, 6] = np.cos(roll) * np.sin(yaw), np.cos(roll) * np.cos(yaw)
    return found


def sent(edges, stamps, received=None, at=None, node='', origin=BEGIN, static=False):
    """
    Return messages.

    :param edges: such as ``'map odom, odom base'``: each message has all of them.
    :param stamps: since the origin, nanoseconds; 0 by the clock is ``-origin``.
    :param received: since ``BEGIN``, nanoseconds; None: as the stamps.
    :param at: (N, 7) the poses of each edge.
    """
    names = [tuple(edge.split()) for edge in edges.split(',')]
    received = stamps if received is None else received
    at = poses(len(stamps)) if at is None else at
    return [ReceivedMessage(Batch(names, [stamp] * len(names), [pose.tobytes()] * len(names)),
                            arrived, '/tf_static' if static else '/tf', static, node)
            for stamp, arrived, pose in zip((origin + stamps).tolist(), (
                BEGIN + np.asarray(received)).tolist(), at, strict=True)]


def fixed(edges, received=0.0, node=''):
    """Return one message of static edges."""
    return sent(edges, np.zeros(1, int), from_seconds([received]), node=node, static=True)


def refused(kind, parent, child, times=1, node='', detail='a detail'):
    """Return the incidents of some transforms."""
    return [Incident(kind, parent, child, 0, node, detail)] * times


def examined(*messages, incidents=(), doctor=None):
    """Return a doctor that has received messages, in order of arrival, and incidents."""
    doctor = doctor or Doctor()
    for message in sorted(sum(messages, []), key=attrgetter('received')):
        doctor.received(message)
    for each in incidents:
        doctor.saw_incidents(each)
    return doctor


def said(code, *messages, now=0.0, incidents=(), doctor=None):
    """
    Return what a check says, in words.

    :param now: seconds since ``BEGIN``; at least until the last message.
    """
    doctor = examined(*messages, incidents=incidents, doctor=doctor)
    return [in_words(finding)
            for finding in doctor.findings(BEGIN + from_seconds(now), [CODES[code]])]


def in_words(finding):
    """Return all of a finding, with its cause and fix if they are not the usual ones."""
    usual = CODES[finding.code]
    where = ', '.join(map('>'.join, finding.edges)) or f'({" ".join(finding.frames)})'
    if finding.edges and {*finding.frames} != {frame for edge in finding.edges for frame in edge}:
        where += f' ({" ".join(finding.frames)})'
    numbers = ' '.join(f'{name}={number:.12g}' if number > 1e6 else f'{name}={number:.6g}'
                       for name, number in finding.evidence.items())
    parts = [f'{finding.severity.value} {where}', finding.senders, finding.summary, numbers,
             '' if finding.cause == usual.cause else f'cause: {finding.cause}',
             '' if finding.fix == usual.fix else f'fix: {finding.fix}']
    return ' | '.join(filter(None, parts))
