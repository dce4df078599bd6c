# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# ruff: noqa: RUF100 - flake8 minds imports behind sys.path, ruff does not
"""
The output of each tool for a fault.

``python test/tools/verdicts.py`` in ``scripts/env`` prints the table of docs/doctor_coverage.md.
"""

from argparse import Namespace
import json
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
import warnings

if (tests := str(Path(__file__).parents[1])) not in sys.path:
    sys.path.insert(0, tests)

from diagnosed import levels  # noqa: E402
from domains import isolate  # noqa: E402
from patients import FAULTY, written  # noqa: E402
from tf_tree_py.health.doctor import Doctor  # noqa: E402
from tf_tree_py.tools.recorded_tree import RecordedTree  # noqa: E402
from tf_tree_py.view.model.facts import biggest_root  # noqa: E402
from tf_tree_py.view.model.moment import (  # noqa: E402
    links_of,
    live_moment,  # noqa: E402
    reached,
)
from tool_helpers import tool  # noqa: E402

HEADINGS = ('fault', 'tf_doctor', 'tf_monitor', 'tf_frames', 'tf_view', '/diagnostics')


def verdicts(code, bag, node):
    """Return the row of a fault: the output and the exit status of each tool."""
    return (f'`{code}`', *_of_doctor(code, bag), _of_frames(bag), _of_view(bag),
            levels(code, node))


def row(cells):
    """Return a row as on the page."""
    return f'| {" | ".join(cells)} |'


def _of_doctor(code, bag):
    done = tool('tf_doctor', '--bag', bag, '--json')
    found = next(one for one in json.loads(done.stdout)['findings'] if one['code'] == code)
    watched = tool('tf_monitor', '--bag', bag, '--json')
    look = json.loads(watched.stdout)
    marks = [one['severity'] for one in look['findings'] if one['code'] == code]
    return (f'{found["severity"]}, {done.returncode}',
            f'{marks[0] if marks else "-"}, {watched.returncode}')


def _of_frames(bag):
    done = tool('tf_frames', '--bag', bag, '--json')
    graph = json.loads(done.stdout)
    said = [*(['refused'] if graph['refused'] else []),
            *(['in pieces'] if len(graph['roots']) > 1 else []),
            *(['stale'] if any(edge['stale'] for edge in graph['edges']) else [])]
    # Its text also names every other error.
    return f'{", ".join(said) or ("the error" if done.returncode else "-")}, {done.returncode}'


def _of_view(bag):
    """Return the appearance of a live page when all of a bag has arrived."""
    doctor = Doctor()
    arguments = Namespace(bag=bag, tf_topic=None, tf_static_topic=None)
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        with RecordedTree(arguments, [doctor], doctor.limits.cache_time) as tree_input:
            tree_input.watch(None)
            edges = tree_input.buffer.edges()
            root = biggest_root(edges)
            moment = live_moment(tree_input.buffer, root, tree_input.now(), doctor.left_behind)
    if reached(root, links_of(edges)) - {*moment.frames}:
        return 'not drawn'
    return 'grey' if moment.stale.any() else 'its findings'


def main():
    """Print the table."""
    import rclpy
    from rclpy.node import Node
    isolate()
    rclpy.init()
    node = Node('verdicts')
    print(row(HEADINGS))
    print(row(['---'] * len(HEADINGS)))
    with TemporaryDirectory() as folder:
        for code in FAULTY:
            print(row(verdicts(code, written(code, Path(folder)), node)), flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
