# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The tests of the compiled formulas, where a wrong read or an undefined operation ends them."""

from importlib.util import find_spec
import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig

from programs import completed
import pytest
from tf_tree_py.core import COMPILED

REPOSITORY = Path(__file__).parents[2]
TESTS = REPOSITORY / 'test'
OF_C, OF_THREADS = TESTS / 'core' / 'test_compiled.py', TESTS / 'core' / 'test_threads.py'
FLAGS = '-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -g -O1'

pytestmark = pytest.mark.skipif(not COMPILED, reason='the formulas are not compiled')


def runtime(name):
    """Return the file of a sanitizer that the compiler would link, or skip."""
    compiler = (os.environ.get('CC') or sysconfig.get_config_var('CC') or 'cc').split()[0]
    if shutil.which(compiler) is None:
        pytest.skip('needs a C compiler')
    path = subprocess.run([compiler, f'-print-file-name={name}.so'], capture_output=True,
                          text=True, check=True).stdout.strip()
    if not Path(path).is_absolute():
        pytest.skip(f'needs {name}.so of gcc')
    return path


def built(folder, old='', new=''):
    """
    Build a copy of tf_tree_py with sanitizers, and return the environment of a Python with it.

    :param old: what to replace in the C file, to make a fault.
    """
    if find_spec('setuptools') is None:
        pytest.skip('needs setuptools')
    preloaded = f'{runtime("libasan")}:{runtime("libubsan")}'
    for name in 'setup.py', 'package.xml', 'README.md':
        shutil.copy(REPOSITORY / name, folder)
    shutil.copytree(REPOSITORY / 'tf_tree_py', folder / 'tf_tree_py',
                    ignore=shutil.ignore_patterns('__pycache__', '*.so'))
    source = folder / 'tf_tree_py' / 'core' / 'tree' / 'path_in_c.c'
    code = source.read_text()
    assert not old or code.count(old) == 1
    source.write_text(code.replace(old, new))
    done = completed(sys.executable, 'setup.py', 'build_ext', '--inplace', cwd=folder,
                     env={**os.environ, 'CFLAGS': FLAGS, 'LDFLAGS': FLAGS})
    assert list(source.parent.glob('path_in_c.*.so')), done.stderr
    return {**os.environ, 'PYTHONPATH': f'{folder}:{TESTS}', 'LD_PRELOAD': preloaded,
            # Python's own allocator would hide overruns, and it frees little when it ends.
            'PYTHONMALLOC': 'malloc', 'ASAN_OPTIONS': 'detect_leaks=0'}


def test_nothing_is_read_outside_of_memory_and_all_is_defined(tmp_path):
    done = completed(sys.executable, '-m', 'pytest', '--quiet', '--noconftest', '-c', os.devnull,
                     '-p', 'no:cacheprovider', '--hypothesis-seed', '0',
                     '--deselect', f'{OF_C}::test_nothing_is_kept', str(OF_C), str(OF_THREADS),
                     env=built(tmp_path), cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert ' passed' in done.stdout and ' skipped' not in done.stdout


PAST_THE_END = """
from array import array
from tf_tree_py.core.edges.packed import Columns
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.tree.path import pose_in_c

history = Samples('b', 10)
history.lie_on(Columns(memoryview(array('q', [10, 20])), memoryview(array('d', [1.0] * 14)),
                       None, ()), 'a')
print(pose_in_c((history,), (), 15))
pose_in_c((history,), (), 25)
"""


def test_a_read_past_the_end_would_be_noticed(tmp_path):
    environment = built(tmp_path, 'older < horizon || (older != stamp && after == count)',
                        'older < horizon')
    done = completed(sys.executable, '-c', PAST_THE_END, env=environment, cwd=tmp_path)
    assert done.stdout.startswith('(1.0, ')
    assert done.returncode != 0
    assert 'AddressSanitizer: heap-buffer-overflow' in done.stderr
