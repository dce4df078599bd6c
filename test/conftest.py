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

"""What holds for the tests of all folders."""

from pathlib import Path
import signal

import effort  # noqa: F401 - it loads the profile of hypothesis
import pytest

_TESTS = Path(__file__).parent

# Where files take long, or wait for programs that they start: where several workers share them
# out, they begin with these, so that none has the longest for itself at the end.
_BEGIN_WITH = ['jazzy', 'view', 'docs', 'labs', 'tools', 'nodes', 'dropin', 'ros']


def pytest_configure(config):
    """
    Let processes that tests start hear Ctrl-C, also where this one is to ignore it.

    A shell makes what it runs in the background ignore SIGINT, and children inherit that.
    They do not inherit a handler, so here is one that ignores it as well.
    """
    # Else pytest-xdist begins with the files that have the most tests.
    config.option.loadscopereorder = False
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Give a worker a file; or all that look at what the labs report, which run once for them."""
    from xdist.scheduler import LoadFileScheduling

    class Sharing(LoadFileScheduling):

        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return 'labs' if file in reported else file

    reported = {f'test/labs/{path.name}' for path in (_TESTS / 'labs').glob('test_*.py')
                if 'lab_reports' in path.read_text()}
    return Sharing(config, log) if config.option.dist == 'loadfile' else None


def pytest_collection_modifyitems(items):
    """Put the folders whose files take longest first."""
    items.sort(key=_turn_of)


def _turn_of(item):
    folder = item.path.parent.name
    return _BEGIN_WITH.index(folder) if folder in _BEGIN_WITH else len(_BEGIN_WITH)
