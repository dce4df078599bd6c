# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A real Chromium for pages; without it, the tests skip and name the missing program."""

import os
import shutil

from programs import PATIENCE_S
import pytest

_PROGRAMS = ('chromium', 'chromium-browser', 'google-chrome')
# Without a graphics card, pictures are drawn by the processor.
_OPTIONS = ('--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
            *(['--no-sandbox'] if os.geteuid() == 0 else []))

# three.js announces its objects where its developer tools listen.
_LISTEN = """
window.scenes = [];
window.__THREE_DEVTOOLS__ = new EventTarget();
window.__THREE_DEVTOOLS__.addEventListener(
  'observe', event => event.detail.isScene && window.scenes.push(event.detail));
"""


# Not for the whole session: playwright's event loop exists as long as the fixture, and meanwhile
# no test of another folder can run asyncio.
@pytest.fixture(scope='module')
def chromium():
    """Return a headless Chromium."""
    pytest.importorskip('viser', reason='pages need viser')
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
    """Return an empty browser window, a small one, because drawing takes time."""
    context = chromium.new_context(viewport={'width': 640, 'height': 480})
    context.set_default_timeout(1000.0 * PATIENCE_S)
    context.add_init_script(_LISTEN)
    yield context
    context.close()
