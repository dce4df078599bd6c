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

"""
What a page of many frames costs: python benchmark/pages.py [FRAMES] [SECONDS].

Needs the extra view, playwright, and Chromium. Frames that all move are inserted 30 times a
second, and looked at in a headless browser. Each row has the processor time of the
server, in percent of a core, above that of inserting while nobody looks; that of the
page's own thread in the browser; how many pictures a second the browser has drawn; and
of ours the delay from an insertion to the picture that shows it. Without a graphics
card the processor draws, outside of that thread. The peer draws the same frames
with one node of viser for each, and neither names, lines nor ground.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import shutil
import statistics
import sys
import threading
import time
from typing import Any, NamedTuple

from playwright.sync_api import Browser, CDPSession, sync_playwright
from tf_tree_py.core import BufferCore, Pose
from tf_tree_py.core.arrivals.sample import Sample
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

# The first frame stands as many metres along z as seconds have passed since the beginning.
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

    def __init__(self, frames: int) -> None:
        self.names = [f'frame_{number}' for number in range(frames)]
        self.buffer = BufferCore()
        self.begin = time.time()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._move)

    def _move(self) -> None:
        while not self._ended.wait(1.0 / RATE_HZ):
            self.insert()

    def insert(self) -> None:
        """Insert where all frames are now: in rows, the first one higher than the others."""
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


class Row(NamedTuple):
    """What was measured of one way to draw."""

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
    """Serve a node of viser for each frame."""
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
    subject = Subject(robot.buffer, True, time.time_ns)
    with Serving(subject, '127.0.0.1', 18500, 'benchmark') as serving:
        yield serving.url


def busy(action: Callable[[], Any]) -> tuple[float, Any]:
    """Return what share of a core this process takes meanwhile, and the action's result."""
    cpu, wall = time.process_time(), time.monotonic()
    result = action()
    return (time.process_time() - cpu) / (time.monotonic() - wall), result


def measure(name: str, robot: Robot, url: str, pages: int, browser: Browser,
            seconds: float, idle: float) -> Row:
    """Return what pages cost, of which the last is watched."""
    context = browser.new_context(viewport={'width': 640, 'height': 480})
    context.add_init_script(LISTEN)
    opened = [context.new_page() for _ in range(pages)]
    for page in opened:
        page.goto(f'{url}/?fixedDpr=0.5')
        page.wait_for_timeout(4000)
    session = context.new_cdp_session(opened[-1])
    session.send('Performance.enable')
    before = working(session)
    share, (pictures, delays) = busy(lambda: opened[-1].evaluate(WATCH, [robot.begin, seconds]))
    page_share = (working(session) - before) / seconds
    context.close()
    return Row(name, 100.0 * (share - idle), 100.0 * page_share, pictures, delays)


def working(session: CDPSession) -> float:
    """Return for how many seconds the page's thread has worked."""
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
            share, _ = busy(lambda: time.sleep(seconds))
            print(f'{"tf_view, pages closed again":28} {100 * (share - idle):8.1f} %')
        browser.close()


if __name__ == '__main__':
    main(*map(int, sys.argv[1:]))
