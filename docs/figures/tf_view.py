# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Draw docs/images/tf_view.png: the page of tf_view, with a robot that one recognises.

python docs/figures/tf_view.py panda.urdf (needs viser, trimesh, playwright, and Chromium; the
package example-robot-data on PyPI has the description of a Panda, with its meshes)
"""

from pathlib import Path
import re
import shutil
import subprocess
import sys

from playwright.sync_api import Page, sync_playwright

IMAGE = Path(__file__).parents[2] / 'docs' / 'images' / 'tf_view.png'
OPTIONS = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
           '--enable-unsafe-swiftshader']
# As it stands ready for work, radians.
POSE = {'panda_joint2': -0.6, 'panda_joint4': -2.4, 'panda_joint6': 1.9, 'panda_joint7': 0.8,
        'panda_finger_joint1': 0.04}
# Where nothing but the processor draws, pictures come late.
PATIENCE_MS = 240_000


def take(url: str) -> None:
    """Write a picture of the page."""
    program = shutil.which('chromium') or shutil.which('google-chrome')
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=OPTIONS)
        page = browser.new_page(viewport={'width': 1280, 'height': 720})
        page.set_default_timeout(PATIENCE_MS)
        page.goto(f'{url}/?fixedDpr=1')
        page.locator('.tf-status', has_text='frames').wait_for()
        for joint, position in POSE.items():
            move(page, joint, position)
        page.get_by_role('button').filter(has_text='panda_hand_tcp').click()
        page.get_by_role('button', name='see the robot').click()
        # Here the processor draws, of which viser warns.
        page.locator('.mantine-Notification-closeButton').first.click()
        page.wait_for_timeout(15_000)
        page.screenshot(path=IMAGE)
        browser.close()


def move(page: Page, joint: str, position: float) -> None:
    """Type a position into the field of a joint."""
    row = page.locator('.mantine-Flex-root', has=page.locator('label', has_text=joint))
    row.locator('input:not([type=hidden])').last.click()
    page.keyboard.press('Control+A')
    page.keyboard.insert_text(f'{position}')
    page.keyboard.press('Enter')


def main() -> None:
    """Start the page of a description, and take the picture."""
    view = subprocess.Popen(
        [sys.executable, '-m', 'tf_tree_py.view.tf_view', '--urdf', sys.argv[1]],
        stdout=subprocess.PIPE, text=True)
    try:
        assert view.stdout is not None
        take(re.search(r'http://[^ ]+', view.stdout.readline())[0])  # type: ignore[index]
    finally:
        view.terminate()


if __name__ == '__main__':
    main()
