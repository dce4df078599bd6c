# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A tree, and the lookups in it that fail, each for another reason or by another method."""

import re

import numpy as np
import tf_tree_py as tf
from tf_tree_py.core import Sample

SECOND = 10**9
BEGIN = 1_700_000_000 * SECOND
END = BEGIN + 4 * SECOND
# map -> odom is post-dated, like that of AMCL.
POST_DATED = SECOND

_NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
STATIC = [Sample('base', 'camera', 0, _NOTHING), Sample('island', 'tree', 0, _NOTHING)]
"""Two trees: map to camera, and island to tree."""


def moving():
    """Return samples in order of time; pole -> mast is reversed after a long silence."""
    samples = [Sample('pole', 'mast', BEGIN, _NOTHING)]
    for tick in range(201):
        stamp = BEGIN + tick * SECOND // 50
        samples.append(Sample('odom', 'base', stamp, (0.01 * tick, *_NOTHING[1:])))
        if tick % 10 == 0:
            samples.append(Sample('map', 'odom', stamp + POST_DATED, _NOTHING))
    samples.append(Sample('mast', 'pole', BEGIN + 60 * SECOND, _NOTHING))
    return samples


def fill(buffer):
    """Insert all samples; return the buffer."""
    buffer.insert_many(STATIC, static=True, strict=False)
    for sample in moving():
        buffer.insert_many([sample], strict=False)
    return buffer


_POINTS, _SOON, _LATER = np.zeros((2, 3)), END + 1_000_000, END + 20 * SECOND

FAILING = {
    'unknown frame': lambda tree: tree.lookup('map', 'nowhere'),
    'misspelled frame': lambda tree: tree.lookup('map', 'camra'),
    'invalid frame': lambda tree: tree.lookup('/map', 'camera'),
    'two trees': lambda tree: tree.lookup('map', 'tree'),
    'two trees at a stamp': lambda tree: tree.lookup('map', 'tree', END),
    'a bit newer': lambda tree: tree.lookup('map', 'camera', _SOON),
    'a bit newer than the whole tree': lambda tree: tree.lookup(
        'map', 'camera', END + POST_DATED + 1),
    'much newer': lambda tree: tree.lookup('map', 'camera', _LATER),
    'a bit older': lambda tree: tree.lookup('map', 'camera', BEGIN + POST_DATED - 1),
    'much older': lambda tree: tree.lookup('map', 'camera', BEGIN - 20 * SECOND),
    'seconds': lambda tree: tree.lookup('map', 'camera', END // SECOND - 1),
    'an edge that had ended': lambda tree: tree.lookup('pole', 'mast', BEGIN + 20 * SECOND),
    'lookup_at': lambda tree: tree.lookup_at('map', 'camera', _SOON),
    'lookup_full': lambda tree: tree.lookup_full('camera', END, 'camera', _SOON, 'map'),
    'lookup_many': lambda tree: tree.lookup_many('map', 'camera', [END, _SOON, _LATER]),
    'lookup_many, older': lambda tree: tree.lookup_many('map', 'camera', [BEGIN, END]),
    'lookup_many, unknown frame': lambda tree: tree.lookup_many('map', 'nowhere', [END]),
    'lookup_tree': lambda tree: tree.lookup_tree('nowhere'),
    'latest_common_time': lambda tree: tree.latest_common_time('map', 'tree'),
    'frames_between': lambda tree: tree.frames_between('map', 'camera', _LATER),
    'edges_between': lambda tree: tree.edges_between('map', 'camera', _SOON),
    'lookup_framed': lambda tree: tree.lookup_framed('map', 'camera', _SOON),
    'lookup_uncertain': lambda tree: tree.lookup_uncertain('map', 'camera', _SOON),
    'lookup_uncertain_many': lambda tree: tree.lookup_uncertain_many('map', 'camera', [_SOON]),
    'lookup_uncertain_full': lambda tree: tree.lookup_uncertain_full(
        'camera', END, 'camera', _SOON, 'map'),
    'lookup_budget': lambda tree: tree.lookup_budget('map', 'camera', _SOON),
    'lookup_joint': lambda tree: tree.lookup_joint('map', ['camera', 'base'], _SOON),
    'predict': lambda tree: tree.predict('map', 'camera', _LATER, SECOND),
    'lookup_twist': lambda tree: tf.lookup_twist(tree, 'camera', 'map', _LATER, SECOND),
    'lookup_twist_uncertain': lambda tree: tf.lookup_twist_uncertain(
        tree, 'camera', 'map', _LATER, SECOND),
    'lookup_twist_many': lambda tree: tf.lookup_twist_many(
        tree, 'camera', 'map', [_LATER], SECOND),
    'trajectory': lambda tree: tf.trajectory(tree, 'map', 'camera', [_SOON], outside='fail'),
    'stamps_at_rate': lambda tree: tf.stamps_at_rate(tree, 'base', 'camera', 10.0),
    'stamps_at_rate, two trees': lambda tree: tf.stamps_at_rate(tree, 'map', 'tree', 10.0),
    'deskew': lambda tree: tf.deskew(tree, _POINTS, [END, _SOON], 'map', 'camera', END, 'odom'),
}

OF_LIVE_TREES = re.compile(
    r'time-?out|\bwait|\byet\b|sooner|\barriv|should publish|may still|present time|'
    'own message|started later|as long as', re.IGNORECASE)
"""What only makes sense while data may arrive."""


def error_of(lookup, tree):
    """Return the text of the error of a failing lookup."""
    try:
        answer = lookup(tree)
    except tf.TransformException as error:
        return str(error)
    raise AssertionError(f'no error, but {answer}')
