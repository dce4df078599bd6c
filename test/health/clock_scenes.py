# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Small trees with stamps and arrivals that are written out, and what the checks find in them."""

import numpy as np
from tf_tree_py.core import Pose
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.checks.case import Case
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.measures.edge_record import EdgeRecord
from tf_tree_py.health.measures.sample_rows import MessageColumn, Rows
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.ros_graph import NO_GRAPH

SECOND = 10**9
MS = 10**6
BEGIN = 1_700_000_000 * SECOND
POSE = pack_pose(*Pose())


def mixed(count=100):
    """Return the numbers from 0 on in an order without a trend."""
    return np.arange(count) * 37 % count


def regular(count=100, hz=10.0):
    """Return the times of samples at a rate, nanoseconds."""
    return np.rint(np.arange(count) * (SECOND / hz)).astype(np.int64)


def driving(count):
    """Return the poses of a frame that moves on, (7, N)."""
    poses = standing(count)
    poses[0] = 0.01 * np.arange(count)
    return poses


def standing(count):
    """Return the poses of a frame that rests, (7, N)."""
    poses = np.zeros((7, count))
    poses[6] = 1.0
    return poses


def roaming(count):
    """Return the poses of something that a camera sees, (7, N)."""
    poses = standing(count)
    angles = 0.004 * np.arange(count)
    poses[0], poses[5], poses[6] = angles, np.sin(0.5 * angles), np.cos(0.5 * angles)
    return poses


def edge_of(name, times, delays=4 * MS, *, lead=0, poses=driving, senders=(), static=False,
            begin=BEGIN, clock=BEGIN):
    """
    Return the record of one edge.

    :param name: such as ``map>odom``.
    :param times: (N,) when its samples are sent, nanoseconds since the beginning.
    :param delays: nanoseconds from then to the arrivals.
    :param lead: how far the stamps are ahead of these times, nanoseconds.
    :param begin: the first time, by the clock of the stamps; ``clock``: by that of the arrivals.
    """
    times = np.asarray(times, np.int64)
    parent, child = name.split('>')
    edge = EdgeRecord(parent, child)
    edge.add(MessageColumn(
        (parent, child), static, Rows(
            clock + times + delays, begin + times + lead, poses(len(times))),
        np.arange(len(times)), [(parent, child)], frozenset(senders)), Thresholds())
    return edge


def late(name, usual, step=0.0, **how):
    """
    Return an edge at 10 Hz with these delays, milliseconds.

    Of 100 delays that are a step apart, 5 % are 45 steps shorter than the usual one, 5 % are 44
    steps longer, and the middle half are 49 steps apart.
    """
    count, rate = how.pop('count', 100), how.pop('hz', 10.0)
    delays = np.rint((usual + step * (mixed(count) - count // 2)) * MS).astype(np.int64)
    return edge_of(name, regular(count, rate), delays, **how)


def case_of(*edges, now=0, recorded=False, troubles=None, graph=NO_GRAPH, endpoints=()):
    """Return the case of some edges, by default at the last arrival."""
    last = max((edge.moving.timing.last for edge in edges if edge.moving), default=0)
    return Case(edges, {}, troubles or {}, (), endpoints, Thresholds(), now or last, recorded,
                graph)


def found(code, case):
    """Return the findings of one check, each as said below."""
    return [said(finding) for finding in CODES[code].findings(case)]


def said(finding):
    """Return the severity, the edges, the sentence, the numbers; and a cause of its own."""
    usual = CODES[finding.code]
    own = [text for text, other in ((finding.cause, usual.cause), (finding.fix, usual.fix))
           if text not in (other, usual.recorded_fix)]
    return (finding.severity.value, ' '.join('>'.join(edge) for edge in finding.edges),
            finding.summary, ', '.join(
                f'{name}={number:{".13g" if abs(number) > 1e8 else ".6g"}}'
                for name, number in finding.evidence.items()), *own)


# --- messages

def message(*names, at=0.0, received=None, static=False, lead=0.0, slashed=(), authority=''):
    """Return a message of edges such as ``a>b``, sent at a time, seconds."""
    edges = [tuple(name.split('>')) for name in names]
    stamp = BEGIN + round((at + lead) * SECOND)
    arrived = BEGIN + round(at * SECOND) if received is None else received
    return ReceivedMessage(Batch(edges, [stamp] * len(edges), [POSE] * len(edges), slashed),
                           arrived, '/tf_static' if static else '/tf', static, authority)


def stream(*names, begin=0.0, end=10.0, **how):
    """Return messages at 10 Hz."""
    return [message(*names, at=number / 10, **how)
            for number in range(round(10 * begin), round(10 * end))]
