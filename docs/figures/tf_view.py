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
Draw docs/images/tf_view.png: the page of tf_view, with the five frames and their robot.

python docs/figures/tf_view.py (needs ROS, viser, playwright, and Chromium)
"""

from pathlib import Path
import re
import shutil
import subprocess
import sys

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
IMAGE = ROOT / 'docs' / 'images' / 'tf_view.png'
OPTIONS = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
           '--enable-unsafe-swiftshader']


def take(url: str) -> None:
    """Write a picture of the page, where the gripper has left a trail."""
    program = shutil.which('chromium') or shutil.which('google-chrome')
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=OPTIONS)
        page = browser.new_page(viewport={'width': 1280, 'height': 720})
        page.goto(url)
        page.locator('.tf-status', has_text='5 frames').wait_for()
        page.wait_for_timeout(12_000)  # until there is a trail to be seen
        page.get_by_role('button', name='pause', exact=True).click()
        page.get_by_role('button').filter(has_text='gripper').click()
        page.get_by_role('tab', name='chosen').click()
        page.get_by_role('checkbox', name='trail').check()
        page.get_by_role('tab', name='look').click()
        page.get_by_role('button', name='see all').click()
        page.get_by_role('tab', name='frames').click()
        # Here the processor draws, of which viser warns.
        page.locator('.mantine-Notification-closeButton').click()
        page.wait_for_timeout(3_000)
        page.screenshot(path=IMAGE)
        browser.close()


def main() -> None:
    """Start the robot and the page, and take the picture."""
    robot = subprocess.Popen([sys.executable, '-m', 'tf_tree_py.nodes.five_frame_publisher'])
    view = subprocess.Popen(
        [sys.executable, '-m', 'tf_tree_py.view.tf_view', '--urdf',
         ROOT / 'config' / 'five_frames.urdf'], stdout=subprocess.PIPE, text=True)
    try:
        assert view.stdout is not None
        take(re.search(r'http://\S+', view.stdout.readline())[0])  # type: ignore[index]
    finally:
        for process in (robot, view):
            process.terminate()


if __name__ == '__main__':
    main()
