# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Keep many pages open: ``python -m benchmark.page_soak [--pages 50] [--minutes 15] [--rate 30]``.

Needs the extra view, playwright, and Chromium on Linux. A server shows moving frames, 200 unless
``--frames`` is given, and a scan of 1,000 points on every page. All pages receive everything, but
only the last one draws every picture, because one machine cannot draw for fifty. Two cores suffice
for fifty pages with two updates a second. ``--unread`` adds pages that never read.

Each line has the server's CPU time, in percent of a core, above that of inserting without pages,
its memory, threads and descriptors, and the memory of the browser. At the end, the memory of the
last third of the run is compared with that of the second third. The exit status is 0 if the memory
of both processes levels off.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import shutil
import sys
import time
from typing import NamedTuple

from playwright.sync_api import Browser, Page, sync_playwright
from tf_tree_py.view.serving import RATE_HZ, Serving

from .pages import busy, OPTIONS, Robot, show_scan, subject_of
from .resources import MB, MORE_MEMORY, MORE_THREADS, Use, use_of
from .unread import unread_pages

_LINE_S, _IDLE_S = 10.0, 10.0
_PORT = 18500
# Lets a page draw once in two minutes from the time when it sets a variable.
_DRAWING = """
const draw = window.requestAnimationFrame.bind(window)
window.requestAnimationFrame = callback => window.drawsRarely
    ? setTimeout(() => callback(performance.now()), 120_000) : draw(callback)
"""


class Look(NamedTuple):
    """
    The measurements at one time.

    :ivar browser: memory of all processes of the browser, bytes.
    """

    server: Use
    browser: int


def browser_memory() -> int:
    """Return the memory of all child processes, bytes; shared pages are divided among them."""
    parents = {}
    for entry in Path('/proc').iterdir():
        try:
            if entry.name.isdigit():
                stat = (entry / 'stat').read_text()
                parents[int(entry.name)] = int(stat.rpartition(')')[2].split()[1])
        except OSError:
            continue  # the process has ended
    family = {os.getpid()}
    while more := {pid for pid, parent in parents.items() if parent in family} - family:
        family |= more
    return sum(map(_proportional, family - {os.getpid()}))


def _proportional(pid: int) -> int:
    try:
        lines = Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()
    except OSError:
        return 0
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith('Pss:')), 0)


@contextmanager
def opened(browser: Browser, url: str, count: int) -> Iterator[list[Page]]:
    """Open pages of a few pixels, which show the scan; only the last one draws all the time."""
    context = browser.new_context(viewport={'width': 640, 'height': 480})
    context.set_default_timeout(300_000.0)
    context.add_init_script(_DRAWING)
    pages: list[Page] = []
    for _ in range(count):
        if pages:
            pages[-1].evaluate('window.drawsRarely = true')
        page = context.new_page()
        page.goto(f'{url}/?fixedDpr=0.1')
        show_scan(page)
        pages.append(page)
    yield pages
    context.close()


def watch(pages: Sequence[Page], seconds: float, idle: float) -> list[Look]:
    """Print a line every few seconds; return the measurements."""
    looks: list[Look] = []
    begin = time.monotonic()
    while time.monotonic() < begin + seconds:
        share, _ = busy(lambda: pages[-1].wait_for_timeout(1e3 * _LINE_S))
        looks.append(Look(use_of(os.getpid()), browser_memory()))
        server, memory = looks[-1]
        print(f'{time.monotonic() - begin:6.0f} s: server {100.0 * (share - idle):5.1f} % of a '
              f'core, {server.memory / MB:.0f} MB, {server.threads} threads, '
              f'{server.descriptors} descriptors; browser {memory / MB:.0f} MB; '
              f'{status(pages[0])}', flush=True)
    return looks


def status(page: Page) -> str:
    """Return the status line of a page, which contains the displayed time."""
    return page.locator('.tf-status').inner_text()


def judge(looks: Sequence[Look]) -> bool:
    """Print and return whether the memory of the server and the browser levels off."""
    third = len(looks) // 3
    before, after = looks[third:2 * third], looks[2 * third:]
    well = True
    for name, memory in (('server', lambda look: look.server.memory),
                         ('browser', lambda look: look.browser)):
        first, last = max(map(memory, before)), max(map(memory, after))
        level = last <= MORE_MEMORY * first
        print(f'{name}: {first / MB:.0f} MB, then {last / MB:.0f} MB: '
              f'{"level" if level else "it grows"}')
        well = well and level
    threads = [max(look.server.threads for look in part) for part in (before, after)]
    return well and threads[1] <= threads[0] + MORE_THREADS


def soak(count: int, minutes: float, rate_hz: float, frames: int, unread: int) -> bool:
    """Open pages for some minutes; return whether memory and threads level off."""
    program = shutil.which('chromium') or shutil.which('google-chrome')
    with sync_playwright() as driver, Robot(frames, rate_hz=rate_hz) as robot:
        browser = driver.chromium.launch(executable_path=program, args=OPTIONS)
        idle, _ = busy(lambda: time.sleep(_IDLE_S))
        with Serving(subject_of(robot), '127.0.0.1', _PORT, 'benchmark') as serving:
            begin = time.monotonic()
            silent = unread_pages(_PORT, unread)
            with opened(browser, serving.url, count) as pages:
                print(f'{count} pages with {frames} frames and a scan opened in '
                      f'{time.monotonic() - begin:.0f} s; inserting alone: {100 * idle:.1f} % '
                      'of a core', flush=True)
                looks = watch(pages, 60.0 * minutes, idle)
            for one in silent:
                one.close()
            serving.wait_until_closed()
            share, _ = busy(lambda: time.sleep(_IDLE_S))
            print(f'all pages closed: server {100.0 * (share - idle):.1f} % of a core, '
                  f'{use_of(os.getpid()).memory / MB:.0f} MB')
        browser.close()
    return judge(looks)


def main() -> int:
    """Run the soak; return 0 if memory and threads level off."""
    parser = argparse.ArgumentParser(prog='python -m benchmark.page_soak', description=__doc__)
    parser.add_argument('--pages', type=int, default=50, help='default: 50')
    parser.add_argument('--minutes', type=float, default=15.0, help='default: 15')
    parser.add_argument('--rate', type=float, default=RATE_HZ,
                        help='updates a second; default: 30')
    parser.add_argument('--frames', type=int, default=200, help='default: 200')
    parser.add_argument('--unread', type=int, default=0, help='pages that never read; default: 0')
    arguments = parser.parse_args()
    return 0 if soak(arguments.pages, arguments.minutes, arguments.rate, arguments.frames,
                     arguments.unread) else 1


if __name__ == '__main__':
    sys.exit(main())
