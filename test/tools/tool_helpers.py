# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The tools by their real command lines, and the documented shapes of their output."""

from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module
import io
from pathlib import Path
import re
import signal
import subprocess
import sys

from programs import Program

PAGES = Path(__file__).parents[2] / 'docs'
TYPES = {'int': (int,), 'number': (int, float), 'text': (str,), 'list': (list,),
         'object': (dict,), 'bool': (bool,), 'null': (type(None),)}


def command(name):
    return (sys.executable, '-m', f'tf_tree_py.tools.{name}')


def tool(name, *arguments, entry='main'):
    """Run a tool's command line in this process; return the result like that of a process."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    out, err = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(err):
            run = getattr(import_module(f'tf_tree_py.tools.{name}'), entry)
            status = run([name, *map(str, arguments)])
    except SystemExit as end:
        status = end.code
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    return subprocess.CompletedProcess(arguments, status, out.getvalue(), err.getvalue())


def started(name, *arguments):
    """Return a started tool."""
    return Program(*command(name), *map(str, arguments))


def documented(page, heading):
    """Return the types of the keys that a page lists below a heading."""
    section = (PAGES / f'{page}.md').read_text().partition(f'{heading}\n')[2].partition('\n#')[0]
    rows = re.findall(r'^\| `(\w+)` \| (\w+)(?: or (\w+))? \|', section, re.MULTILINE)
    assert rows, heading
    return {key: sum((TYPES[cls] for cls in kinds if cls), ()) for key, *kinds in rows}


def assert_shape(data, page, heading):
    """Assert that an object has the documented keys and types."""
    promised = documented(page, heading)
    differing = sorted(data.keys() ^ promised.keys())
    assert not differing, f'only in the output or in the table of {heading!r} in docs/{page}.md'
    for key, kinds in promised.items():
        assert isinstance(data[key], kinds), key


def assert_one_sentence(done, name, sentence):
    """Assert that a tool printed its reason in one sentence, and nothing else."""
    assert (done.returncode, done.stdout) == (2, '')
    # rcl may have logged before.
    line = done.stderr.splitlines()[-1]
    assert line.startswith(f'{name}: ') and sentence in line
