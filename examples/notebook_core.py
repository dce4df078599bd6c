# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Run it as a whole, `python3 examples/notebook_core.py`, or cell by cell in an editor that
# supports "# %%" (VS Code, PyCharm, Spyder; jupytext makes a notebook of it). It needs numpy,
# scipy and tf_tree_py, and no ROS.
"""The transform tree without ROS, cell by cell."""

# %% [markdown]
# A small tree. `insert(parent, child, stamp, pose)` takes `parent_T_child`; a stamp is a whole
# number of nanoseconds. A robot drives straight ahead at 1 m/s and turns as it goes; its camera
# looks forward and a little down, and never moves.

# %%
import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.core import from_seconds, LATEST, Pose, TransformException

buffer = BufferCore(cache_time=from_seconds(10.0))
for t in (1.0, 2.0, 3.0):
    buffer.insert('map', 'base', from_seconds(t), Pose.from_xyz_rpy(x=t, yaw=0.2 * t))
buffer.insert('base', 'camera', LATEST, Pose.from_xyz_rpy(x=0.2, z=0.8, pitch=np.radians(10.0)),
              static=True)
for edge in buffer.edges():
    print(edge.parent, '->', edge.child, 'static' if edge.static else f'{edge.samples} samples')

# %% [markdown]
# `lookup('map', 'camera')` is `map_T_camera`: it takes coordinates in camera to coordinates in
# map. Read a product so that the inner names cancel.

# %%
camera_p = np.array([2.0, 0.0, 0.0])
map_T_camera = buffer.lookup('map', 'camera', from_seconds(2.0))
map_p = map_T_camera @ camera_p
print('map_T_camera:', map_T_camera)
print('2 m ahead of the camera is, in the map:', map_p.round(3))
print('and back again:', (map_T_camera.inverse() @ map_p).round(3))

# Many points at once: (N, 3).
camera_points = np.array([[1.0, 0.0, 0.0], [2.0, 0.5, 0.0], [3.0, 0.0, 0.5]])
print('three points in the map:', (map_T_camera @ camera_points).round(3).tolist())

# %% [markdown]
# Latest or stamped: an image of 1.5 s was taken from the camera's pose at that time, not from its
# current pose. Between two samples the buffer interpolates.

# %%
image_stamp = from_seconds(1.5)
stamped = buffer.lookup('map', 'camera', image_stamp) @ camera_p
latest = buffer.lookup('map', 'camera', LATEST) @ camera_p
print('with the stamp of the image:', stamped.round(3))
print('with the latest transform:  ', latest.round(3))
print(f'the difference: {np.linalg.norm(latest - stamped):.3f} m')

# %% [markdown]
# A lookup that cannot be answered raises an error with the edge, the requested and the available
# stamps.

# %%
try:
    buffer.lookup('map', 'camera', from_seconds(3.2))
except TransformException as error:
    print(type(error).__name__, '-', error)
    too_new = error

# The facts are attributes of the error.
print(too_new.parent, too_new.child, (too_new.requested - too_new.latest) / 1e9, 's too new')

# %% [markdown]
# The order of composition matters: moving and then turning is not turning and then moving.

# %%
go, turn = Pose(x=1.0), Pose.from_xyz_rpy(yaw=np.pi / 2)
print('go @ turn:', go @ turn)
print('turn @ go:', turn @ go)

# The buffer composes along the tree: map_T_camera = map_T_base @ base_T_camera.
map_T_base = buffer.lookup('map', 'base', image_stamp)
base_T_camera = buffer.lookup('base', 'camera', image_stamp)
by_hand, by_lookup = map_T_base @ base_T_camera, buffer.lookup('map', 'camera', image_stamp)
print('by hand as by lookup:', np.allclose(by_hand.as_matrix(), by_lookup.as_matrix()))
