# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Run it as a whole, `python3 examples/notebook_calibration.py [BAG]`, or cell by cell in an editor
# that supports "# %%". It needs rosbags and matplotlib, and no ROS. Without a bag it makes one.
"""From a bag to the answer whether the camera is mounted elsewhere, or its stamps are late."""

# %% [markdown]
# This cell only makes a bag: /tf, /tf_static, and a tag on the wall that the camera sees. The
# mounting is wrong by 2 cm and 1 degree, and the camera's stamps are 60 ms late.

# %%
from math import degrees, radians
from pathlib import Path
import sys

import matplotlib.pyplot as plt
import numpy as np
from tf_tree_py import BufferCore, from_seconds, Pose, screws, se3, UNLIMITED
from tf_tree_py.bag import open_bag
from tf_tree_py.calibration import calibrate, Limits, recorded_observations

LATE = 60_000_000


def make_bag(path):
    rng = np.random.default_rng(4)
    seconds = np.arange(0.0, 30.0, 0.02)
    stamps = from_seconds(1_700_000_000) + np.round(seconds * 1e9).astype(np.int64)
    map_T_base = screws.exp_many(np.stack([
        0.8 * np.sin(0.6 * seconds), 0.5 * np.cos(0.4 * seconds), 0.05 * np.sin(0.9 * seconds),
        0.1 * np.sin(1.1 * seconds), 0.1 * np.cos(0.8 * seconds), 0.5 * np.sin(0.5 * seconds)], 1))
    true = Pose.from_xyz_rpy(x=0.3, z=0.9, pitch=0.2)
    robot = BufferCore(cache_time=UNLIMITED)
    robot.insert_track('map', 'base', stamps, map_T_base)
    robot.insert('base', 'camera', 0, Pose.from_xyz_rpy(
        x=0.32, z=0.9, pitch=0.2, yaw=radians(1.0)), static=True)
    taken = np.arange(20, len(stamps) - 20, 10)
    map_T_camera = se3.compose_many(map_T_base[taken], np.array([true]))
    seen = se3.compose_many(se3.inverse_many(map_T_camera), np.array([Pose(x=4.0, z=1.2)]))
    seen = se3.compose_many(seen, screws.exp_many(0.002 * rng.normal(size=(len(taken), 6))))
    robot.insert_track('camera', 'tag_7', stamps[taken] + LATE, seen)
    robot.record(path)


bag = Path(sys.argv[1]) if len(sys.argv) > 1 else Path('late_camera.mcap')
if not bag.exists():
    make_bag(bag)

# %% [markdown]
# The observations are the samples of the tag's frame. A topic would be named `/detections`.

# %%
recording = open_bag(bag)
seen = recorded_observations(recording, ['tf:tag_7'], fixed_in='map', known={})
found = calibrate(recording, ('base', 'camera'), seen, time=True, limits=Limits(max_offset_s=0.2))
print(f'The verdict: {found.verdict}')
for each in found.explanations:
    print(f'  {each.name}: {each.unexplained_m * 1e3:.1f} mm unexplained')
print(f'The stamps are {found.time_offset_s * 1e3:.1f} ms late, '
      f'sigma {found.time_offset_sigma_s * 1e3:.1f} ms')
print(f'The mounting has moved by {found.edge.moved_m * 1e3:.0f} mm and '
      f'{degrees(found.edge.turned_rad):.1f} degrees')
for hidden in found.unobservable:
    print(f'Not visible: {hidden.what}; {hidden.remedy}')

# %% [markdown]
# The error of the tag against its speed past the camera: an error that grows with speed is an
# error of time.

# %%
trace = found.trace
plt.plot(trace.speed, trace.before_m * 1e3, 'x', label='before')
plt.plot(trace.speed, trace.after_m * 1e3, '.', label='after')
plt.xlabel('speed of the tag past the camera [m/s]')
plt.ylabel('error of the tag [mm]')
plt.legend()
plt.savefig('late_camera.png')
