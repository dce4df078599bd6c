# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A page in the browser: the content of its scene, read from three.js, and its controls."""

from itertools import combinations
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

# A page that is not currently painted has no next picture.
_NEXT_PICTURE = """() => new Promise(done => {
  requestAnimationFrame(done);
  setTimeout(done, 200);
})"""

# Whichever axis is up on the page, the lines' own axes are those of the fixed frame.
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


# viser draws all names with one mesh of rectangles; this repeats its shader's computation. The
# camera is only available to objects that are being drawn.
_NAMES = """() => {
  const names = [];
  window.scenes.forEach(scene => scene.traverseVisible(node => {
    const {aRect, aParams, aLabelIndex} = node.geometry?.attributes ?? {};
    const uniforms = node.material?.uniforms;
    if (!aRect || uniforms.uAtlas) return;
    node.onBeforeRender = (_, __, camera) => { window.tfCamera = camera; };
    const camera = window.tfCamera;
    if (!camera) return;
    const height = uniforms.uViewportHeight.value;
    const canvas = document.querySelector('canvas');
    for (let at = 0; at < node.geometry.instanceCount; ++at) {
      const data = uniforms.uLabelData.value.image.data;
      const [x, y, z, seen] = data.slice(4 * aLabelIndex.getX(at), 4 * aLabelIndex.getX(at) + 4);
      const place = camera.position.clone().set(x, y, z).applyMatrix4(camera.matrixWorldInverse);
      if (!seen || place.z >= 0) continue;
      const em = aParams.getY(at) * 80 * seen / 2;
      const pixel = place.clone().applyMatrix4(camera.projectionMatrix);
      const left = (pixel.x + 1) / 2 * canvas.clientWidth + aRect.getX(at) * em;
      const bottom = (1 - pixel.y) / 2 * height - aRect.getY(at) * em;
      names.push([left, bottom - aRect.getW(at) * em, left + aRect.getZ(at) * em, bottom]);
    }
  }));
  return names;
}"""

# The positions of the frames in the window, with the camera that drew the names.
_PIXELS = """() => {
  const box = document.querySelector('canvas').getBoundingClientRect();
  const pixels = [];
  const camera = window.tfCamera;
  window.scenes.forEach(scene => scene.traverseVisible(node => {
    if (!node.isInstancedMesh || node.geometry.type !== 'CylinderGeometry') return;
    for (let at = 0; at < node.count; at += 3) {
      const matrix = node.instanceMatrix.array.slice(16 * at, 16 * at + 16);
      const place = camera.position.clone()
        .set(...[0, 1, 2].map(axis => matrix[12 + axis] - matrix[4 + axis] / 2))
        .applyMatrix4(node.matrixWorld).project(camera);
      pixels.push([box.left + (place.x + 1) / 2 * box.width,
                   box.top + (1 - place.y) / 2 * box.height]);
    }
  }));
  return pixels;
}"""

# The controls are over or beside the picture: the outermost box around their tabs that does not
# contain the picture.
_PANEL = """() => {
  const canvas = document.querySelector('canvas');
  let panel = document.querySelector('.tf-status');
  while (!panel.parentElement.contains(canvas)) panel = panel.parentElement;
  const box = panel.getBoundingClientRect();
  return [box.left, box.top, box.right, box.bottom];
}"""


class OpenPage:
    """
    A page that is open in a browser window.

    :ivar complaints: errors in its console.
    """

    def __init__(self, window, url, query=''):
        self.page = window.new_page()
        self.complaints = []
        self.page.on('console', lambda message: message.type == 'error'
                     and self.complaints.append(message.text))
        self.page.on('pageerror', lambda error: self.complaints.append(str(error)))
        self.page.goto(f'{url}/?fixedDpr=0.5{query}')  # pictures with fewer pixels are faster
        self.wait_for_text('frames')

    def wait_for_text(self, text):
        """Wait until the status line, with the displayed moment, contains a text."""
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
        """Return the field after a label; viser does not connect them for all types."""
        return self.page.locator(
            '.mantine-Flex-root', has=self.page.locator('label', has_text=label)
        ).locator('input:not([type=hidden])').last

    # --- the scene

    def scene(self):
        """Return the content of the scene."""
        return self.page.evaluate(_READ)

    def axes(self):
        """Return position, scale and rotation (N, 3, 3) of the drawn axes."""
        matrices = np.array(self.scene()['axes'][0]).reshape(-1, 3, 4, 4)
        # Columns come first. A cylinder extends along its own y, and its middle is half a length
        # from the frame.
        along, middle = matrices[:, :, 1, :3], matrices[:, :, 3, :3]
        scale = np.linalg.norm(along[:, 0], axis=1)
        with np.errstate(invalid='ignore'):
            rotation = (along / scale[:, None, None]).swapaxes(1, 2)
        return middle[:, 0] - along[:, 0] / 2.0, scale, rotation

    def lines(self):
        """Return both ends of the drawn lines, and their colours, both (N, 2, 3)."""
        drawn = self.scene()['lines']
        return tuple(np.array(drawn[0][name] if drawn else ()).reshape(-1, 2, 3)
                     for name in ('points', 'colors'))

    def wait_for_axes(self, right):
        """Return the axes as soon as a predicate of them is true."""
        return self.wait_for(lambda: self.scene()['axes'] and self.axes(),
                             lambda axes: axes and right(*axes))

    def names(self):
        """Return the area of each name, (N, 4): left, top, right and bottom, CSS pixels."""
        return np.array(self.page.evaluate(_NAMES)).reshape(-1, 4)

    def pixels(self):
        """Return the frames' positions in the window, (N, 2) CSS pixels; call ``names`` before."""
        return np.array(self.page.evaluate(_PIXELS)).reshape(-1, 2)

    def picture(self):
        """Return the area of the picture: left, top, right and bottom, CSS pixels."""
        box = self.page.locator('canvas').first.bounding_box()
        return np.array((box['x'], box['y'], box['x'] + box['width'], box['y'] + box['height']))

    def panel(self):
        """Return the area of the controls: left, top, right and bottom, CSS pixels."""
        return np.array(self.page.evaluate(_PANEL))

    def ellipsoids(self):
        """Return each sphere's matrix relative to a unit sphere, in the page's axes (N, 4, 4)."""
        return np.array(self.page.evaluate(_SPHERES)).reshape(-1, 4, 4).swapaxes(1, 2)

    def wait_for_ellipsoid(self, right):
        """Return as soon as one sphere is visible and a predicate of its matrix is true."""
        self.wait_for(self.ellipsoids, lambda found: len(found) == 1 and right(found[0]))

    def wait_for(self, look, right=bool):
        """Return the result of a function as soon as it is right; call it at every picture."""
        end = time.monotonic() + PATIENCE_S
        while not right(found := look()):
            assert time.monotonic() < end, f'unexpected result: {found}'
            self.page.evaluate(_NEXT_PICTURE)
        return found

    def wait_for_count(self, what, count):
        """Wait until this number of nodes of the scene is visible, by a JavaScript expression."""
        self.page.wait_for_function(f"""() => {{
          let count = 0;
          window.scenes.forEach(scene => scene.traverseVisible(
            node => count += Number({what} || 0)));
          return count === {count};
        }}""")


def overlaps(rectangles):
    """Return whether any two of the rectangles overlap by more than a pixel."""
    return any((np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2]) > 1.0).all()
               for one, other in combinations(rectangles, 2))
