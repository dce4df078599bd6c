# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measure the cost of a page with many frames: ``python -m benchmark.pages [FRAMES] [SECONDS]``.

Needs the extra view, playwright, and Chromium. Moving frames are inserted 30 times a second and
shown in a headless browser. Each row has

- the CPU time of the server, in percent of a core, above that of inserting without pages,
- the CPU time of the page's main thread in the browser,
- the frames per second that the browser draws,
- the delay from an insertion to the picture that shows it.

Without a graphics card, the CPU also draws, outside of that thread. The peer draws the same
frames with one viser node for each, without names, lines and ground. One row adds a scan of
1,000 points at 10 Hz, in a moving frame.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import shutil
import statistics
import sys
import threading
import time
from typing import Any, NamedTuple

import numpy as np
from playwright.sync_api import Browser, CDPSession, Page, sync_playwright
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.view.sensors.readings import Reading, Sensors
from tf_tree_py.view.serving import RATE_HZ, Serving
from tf_tree_py.view.subject import Subject
import viser

OPTIONS = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
           '--enable-unsafe-swiftshader']

LISTEN = """
window.scenes = [];
window.__THREE_DEVTOOLS__ = new EventTarget();
window.__THREE_DEVTOOLS__.addEventListener(
  'observe', event => event.detail.isScene && window.scenes.push(event.detail));
"""

# The height of the first frame, metres, is the number of seconds since the start.
WATCH = """([begin, seconds]) => new Promise(done => {
  const height = () => {
    let found = 0;
    window.scenes.forEach(scene => scene.traverse(node => {
      if (node.isInstancedMesh && node.geometry.type === 'CylinderGeometry')
        for (let i = 0; i < node.count / 3; i++)
          found = Math.max(found, node.instanceMatrix.array[48 * i + 14]);
    }));
    return found;
  };
  const delays = [], until = performance.now() + 1000 * seconds;
  let last = height(), pictures = 0;
  const look = () => {
    pictures += 1;
    const now = height();
    if (now > last) { delays.push(Date.now() / 1000 - begin - now); last = now; }
    if (performance.now() < until) requestAnimationFrame(look);
    else done([pictures / seconds, delays]);
  };
  requestAnimationFrame(look);
})"""


class Robot:
    """Frames that move, in a buffer."""

    def __init__(self, frames: int, cache_s: float = 10.0, rate_hz: float = RATE_HZ) -> None:
        self._period_s = 1.0 / rate_hz
        self.names = [f'frame_{number}' for number in range(frames)]
        self.buffer = BufferCore(round(1e9 * cache_s))
        self.begin = time.time()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._move)

    def _move(self) -> None:
        while not self._ended.wait(self._period_s):
            self.insert()

    def insert(self) -> None:
        """Insert the current poses of all frames, in rows, the first frame above the others."""
        now = time.time()
        heights = [now - self.begin, *[(now - self.begin) / 2.0] * (len(self.names) - 1)]
        self.buffer.insert_many([
            Sample('world', name, int(now * 1e9),
                   Pose(x=0.01 * (number % 20), y=0.01 * (number // 20), z=height))
            for number, (name, height) in enumerate(zip(self.names, heights, strict=True))],
            strict=False)

    def __enter__(self) -> 'Robot':
        self.insert()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()


class Scan(Sensors):
    """A laser that turns with a frame, 10 times a second."""

    _PERIOD = 100_000_000
    _ANGLES = np.linspace(-np.pi, np.pi, 1000)

    def topics(self) -> list[str]:
        """Return the topic of the laser."""
        return ['/scan']

    def reading(self, topic: str, stamp: int) -> Reading | None:
        """Return a scan that is at most a tenth of a second older than a stamp."""
        begin = stamp - stamp % self._PERIOD
        ranges = 2.0 + np.sin(5.0 * self._ANGLES + begin % 10**10 / 1e9)
        points = np.stack([ranges * np.cos(self._ANGLES), ranges * np.sin(self._ANGLES),
                           np.zeros(len(ranges))], axis=1)
        return Reading('frame_1', begin, points)


def subject_of(robot: Robot) -> Subject:
    """Return the content of the pages: moving frames and a laser."""
    return Subject(robot.buffer, True, time.time_ns, sensors=Scan())


def show_scan(page: Page) -> None:
    """Enable the scan of a page."""
    page.get_by_role('tab', name='sensors').click()
    page.get_by_role('checkbox', name='/scan').check()


class Row(NamedTuple):
    """The measurements of one way of drawing."""

    name: str
    server_percent: float
    page_percent: float
    pictures: float
    delays: list[float]

    def __str__(self) -> str:
        delay = f'{1e3 * statistics.median(self.delays):.0f} ms' if self.delays else '-'
        return (f'{self.name:28} {self.server_percent:8.1f} % {self.page_percent:8.1f} % '
                f'{self.pictures:8.1f}/s {delay:>8}')


@contextmanager
def peer(robot: Robot) -> Iterator[str]:
    """Serve one viser node for each frame."""
    server = viser.ViserServer(host='127.0.0.1', port=18400, verbose=False)
    nodes = {name: server.scene.add_frame(f'/{name}') for name in robot.names}
    ended = threading.Event()

    def draw() -> None:
        while not ended.wait(1.0 / RATE_HZ):
            for name, pose in robot.buffer.lookup_tree('world').items():
                if name in nodes:
                    nodes[name].position = pose.translation
                    nodes[name].wxyz = (pose.qw, pose.qx, pose.qy, pose.qz)

    thread = threading.Thread(target=draw)
    thread.start()
    try:
        yield f'http://127.0.0.1:{server.get_port()}'
    finally:
        ended.set()
        thread.join()
        server.stop()


@contextmanager
def ours(robot: Robot) -> Iterator[str]:
    """Serve pages as ``tf_view`` does."""
    with Serving(subject_of(robot), '127.0.0.1', 18500, 'benchmark') as serving:
        yield serving.url


def busy(action: Callable[[], Any]) -> tuple[float, Any]:
    """Return the share of a core that this process uses during an action, and its result."""
    cpu, wall = time.process_time(), time.monotonic()
    result = action()
    return (time.process_time() - cpu) / (time.monotonic() - wall), result


def measure(name: str, robot: Robot, url: str, pages: int, browser: Browser,
            seconds: float, idle: float, prepare: Callable[[Page], None] | None = None) -> Row:
    """Return the cost of some pages. Pictures and delays are those of the last page."""
    context = browser.new_context(viewport={'width': 640, 'height': 480})
    context.add_init_script(LISTEN)
    opened = [context.new_page() for _ in range(pages)]
    for page in opened:
        page.goto(f'{url}/?fixedDpr=0.5')
        if prepare is not None:
            prepare(page)
        page.wait_for_timeout(4000)
    session = context.new_cdp_session(opened[-1])
    session.send('Performance.enable')
    before = working(session)
    share, (pictures, delays) = busy(lambda: opened[-1].evaluate(WATCH, [robot.begin, seconds]))
    page_share = (working(session) - before) / seconds
    context.close()
    return Row(name, 100.0 * (share - idle), 100.0 * page_share, pictures, delays)


def working(session: CDPSession) -> float:
    """Return the seconds for which the page's main thread has worked."""
    metrics = session.send('Performance.getMetrics')['metrics']
    return next(each['value'] for each in metrics if each['name'] == 'TaskDuration')


def main(frames: int = 200, seconds: float = 10.0) -> None:
    """Measure, and print a table."""
    program = shutil.which('chromium') or shutil.which('google-chrome')
    with sync_playwright() as driver, Robot(frames) as robot:
        browser = driver.chromium.launch(executable_path=program, args=OPTIONS)
        idle, _ = busy(lambda: time.sleep(seconds))
        print(f'{frames} frames, {RATE_HZ:g} updates/s, inserting alone: {100 * idle:.1f} % of a '
              'core', flush=True)
        print(f'{"":28} {"server":>10} {"page":>10} {"pictures":>10} {"delay":>8}')
        with peer(robot) as url:
            print(measure('a node for each frame', robot, url, 1, browser, seconds, idle))
        with ours(robot) as url:
            for pages in (1, 2):
                print(measure(f'tf_view, pages open: {pages}', robot, url, pages, browser,
                              seconds, idle), flush=True)
            print(measure('tf_view, one page and a scan', robot, url, 1, browser, seconds, idle,
                          show_scan), flush=True)
            share, _ = busy(lambda: time.sleep(seconds))
            print(f'{"tf_view, pages closed again":28} {100 * (share - idle):8.1f} %')
        browser.close()


if __name__ == '__main__':
    main(*map(int, sys.argv[1:]))
