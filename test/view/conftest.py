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

"""A real Chromium, in which tests open pages; without one they skip and say what is missing."""

import os
import shutil

from programs import PATIENCE_S
import pytest

_PROGRAMS = ('chromium', 'chromium-browser', 'google-chrome')
# Without a graphics card, pictures are drawn by the processor.
_OPTIONS = ('--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
            *(['--no-sandbox'] if os.geteuid() == 0 else []))

# What three.js has made tells of itself where its developers' tools listen.
_LISTEN = """
window.scenes = [];
window.__THREE_DEVTOOLS__ = new EventTarget();
window.__THREE_DEVTOOLS__.addEventListener(
  'observe', event => event.detail.isScene && window.scenes.push(event.detail));
"""


# Not of the whole session: as long as it is there playwright's event loop is, in which no test of
# another folder can run asyncio.
@pytest.fixture(scope='module')
def chromium():
    """Return a headless Chromium."""
    pytest.importorskip('viser', reason="pages need viser: pip install 'tf_tree_py[view]'")
    playwright = pytest.importorskip(
        'playwright.sync_api', reason='Chromium is driven by playwright: pip install playwright')
    with playwright.sync_playwright() as driver:
        own = driver.chromium.executable_path
        program = next(filter(None, map(shutil.which, _PROGRAMS)),
                       own if os.path.exists(own) else None)
        if program is None:
            pytest.skip('pages are tested in Chromium, and there is none: apt install chromium, '
                        'or playwright install chromium')
        browser = driver.chromium.launch(executable_path=program, args=_OPTIONS)
        yield browser
        browser.close()


@pytest.fixture(scope='module')
def window(chromium):
    """Return a browser window that nothing is open in: a small one, for its pictures take time."""
    context = chromium.new_context(viewport={'width': 640, 'height': 480})
    context.set_default_timeout(1000.0 * PATIENCE_S)
    context.add_init_script(_LISTEN)
    yield context
    context.close()
