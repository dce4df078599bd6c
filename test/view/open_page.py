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

"""A page in the browser: what stands in its scene, read back from three.js, and its controls."""

import time

import numpy as np
from programs import PATIENCE_S

# viser draws the axes of N frames as 3 N instances of one cylinder, and lines as segments.
_READ = """() => {
  const found = {axes: [], stale: [], lines: [], points: []};
  const nodes = [];
  window.scenes.forEach(scene => scene.traverse(node => nodes.push(node)));
  for (const node of nodes) {
    let visible = true;
    for (let up = node; up; up = up.parent) visible = visible && up.visible;
    if (!visible || !node.geometry) continue;
    const attributes = node.geometry.attributes;
    if (node.isInstancedMesh && node.geometry.type === 'CylinderGeometry')
      found.axes.push(Array.from(node.instanceMatrix.array.slice(0, 16 * node.count)));
    else if (node.isInstancedMesh || node.isInstancedMesh2)
      found.stale.push(node.count);
    else if (attributes.instanceStart)
      found.lines.push({
        points: Array.from(attributes.instanceStart.data.array),
        colors: Array.from(attributes.instanceColorStart.data.array)});
    else if (node.isPoints)
      found.points.push(Array.from(attributes.position.array));
  }
  return found;
}"""

# A page that is not painted just now has no next picture.
_NEXT_PICTURE = """() => new Promise(done => {
  requestAnimationFrame(done);
  setTimeout(done, 200);
})"""

# Whichever way is up on the page, the lines' own axes are those of the fixed frame.
_SPHERES = """() => {
  const spheres = [];
  let world;
  window.scenes.forEach(scene => scene.traverseVisible(node => {
    const geometry = node.geometry;
    if (geometry?.attributes.instanceStart) world = node.matrixWorld.clone().invert();
    if (!node.isMesh || !/Icosahedron|Sphere/.test(geometry?.type ?? '')) return;
    geometry.computeBoundingSphere();
    if (Math.abs(geometry.boundingSphere.radius - 1.0) < 1e-3) spheres.push(node.matrixWorld);
  }));
  return spheres.map(matrix => matrix.clone().premultiply(world).elements);
}"""


class OpenPage:
    """
    A page that is open in a browser window.

    :ivar complaints: errors in its console.
    """

    def __init__(self, window, url):
        self.page = window.new_page()
        self.complaints = []
        self.page.on('console', lambda message: message.type == 'error'
                     and self.complaints.append(message.text))
        self.page.on('pageerror', lambda error: self.complaints.append(str(error)))
        self.page.goto(f'{url}/?fixedDpr=0.5')  # pictures of fewer points take less time
        self.wait_for_text('frames')

    def wait_for_text(self, text):
        """Wait until the line that says which moment is shown has a text in it."""
        self.page.locator('.tf-status', has_text=text).wait_for()

    def status(self):
        return self.page.locator('.tf-status').inner_text()

    def press(self, name):
        self.page.get_by_role('button', name=name, exact=True).click()

    def turn_to(self, tab):
        self.page.get_by_role('tab', name=tab).click()

    def choose(self, frame):
        self.turn_to('frames')
        self.frame_button(frame).click()

    def frame_button(self, frame):
        return self.page.get_by_role('button').filter(has_text=frame)

    def go_to(self, seconds):
        """Move the slider, by typing into the field beside it."""
        self.field('time [s]').click()
        for key in ('Control+A', *f'{seconds}', 'Enter'):
            self.page.keyboard.press(key)

    def field(self, label):
        """Return the field behind a label; viser does not join them for all kinds."""
        return self.page.locator(
            '.mantine-Flex-root', has=self.page.locator('label', has_text=label)
        ).locator('input:not([type=hidden])').last

    # --- the scene

    def scene(self):
        """Return what is drawn."""
        return self.page.evaluate(_READ)

    def axes(self):
        """Return position, scale and rotation (N, 3, 3) of the axes that are drawn."""
        matrices = np.array(self.scene()['axes'][0]).reshape(-1, 3, 4, 4)
        # Columns come first. A cylinder lies along its own y, its middle half a length from
        # the frame.
        along, middle = matrices[:, :, 1, :3], matrices[:, :, 3, :3]
        scale = np.linalg.norm(along[:, 0], axis=1)
        with np.errstate(invalid='ignore'):
            rotation = (along / scale[:, None, None]).swapaxes(1, 2)
        return middle[:, 0] - along[:, 0] / 2.0, scale, rotation

    def wait_for_axes(self, right):
        """Return the axes as soon as they are right, which a function of them says."""
        return self.wait_for(lambda: self.scene()['axes'] and self.axes(),
                             lambda axes: axes and right(*axes))

    def ellipsoids(self):
        """Return of each sphere what makes it of the unit one, in the page's axes (N, 4, 4)."""
        return np.array(self.page.evaluate(_SPHERES)).reshape(-1, 4, 4).swapaxes(1, 2)

    def wait_for_ellipsoid(self, right):
        """Return as soon as one sphere is seen and right, which a function of its matrix says."""
        self.wait_for(self.ellipsoids, lambda found: len(found) == 1 and right(found[0]))

    def wait_for(self, look, right=bool):
        """Return what a function finds, as soon as it is right; it looks at every picture."""
        end = time.monotonic() + PATIENCE_S
        while not right(found := look()):
            assert time.monotonic() < end, f'what is found is another: {found}'
            self.page.evaluate(_NEXT_PICTURE)
        return found

    def wait_for_count(self, what, count):
        """Wait until so many nodes of the scene can be seen, by a JavaScript expression."""
        self.page.wait_for_function(f"""() => {{
          let count = 0;
          window.scenes.forEach(scene => scene.traverseVisible(
            node => count += Number({what} || 0)));
          return count === {count};
        }}""")
