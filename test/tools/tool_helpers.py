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

"""The tools by their real command lines, and the shapes that their pages promise."""

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
    """Run a tool's command line in this process; return what a process of its own would leave."""
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
    """Return a tool that runs."""
    return Program(*command(name), *map(str, arguments))


def documented(page, heading):
    """Return the types of the keys that a page lists below a heading."""
    section = (PAGES / f'{page}.md').read_text().partition(f'{heading}\n')[2].partition('\n#')[0]
    rows = re.findall(r'^\| `(\w+)` \| (\w+)(?: or (\w+))? \|', section, re.MULTILINE)
    assert rows, heading
    return {key: sum((TYPES[kind] for kind in kinds if kind), ()) for key, *kinds in rows}


def assert_shape(data, page, heading):
    """Hold an object to what a page promises: its keys, and their types."""
    promised = documented(page, heading)
    assert data.keys() == promised.keys()
    for key, kinds in promised.items():
        assert isinstance(data[key], kinds), key


def assert_one_sentence(done, name, sentence):
    """Hold a tool to have said why it cannot, and nothing else."""
    assert (done.returncode, done.stdout) == (2, '')
    # rcl may have logged before.
    line = done.stderr.splitlines()[-1]
    assert line.startswith(f'{name}: ') and sentence in line
