# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A custom representation of motion as an edge of the tree: a Gaussian process.

A tracker reports the pose of a drone ten times a second, with noise of 5 mm. The process smooths
the noise, fills the gaps, and provides the velocity; the tree does the rest. It needs numpy,
scipy and tf_tree_py, and no ROS: `python3 examples/motion_model.py`.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from tf_tree_py import BufferCore, lookup_twist
from tf_tree_py.core import from_seconds, Pose

NOISE, LENGTH = 0.005, 0.35  # metres; the length scale of the motion, seconds


class GaussianProcess:
    """Positions over time with a squared exponential kernel; the drone faces ahead."""

    def __init__(self, stamps, positions):
        self.oldest, self.latest = int(stamps[0]), int(stamps[-1])
        self.times = (stamps - self.oldest) * 1e-9
        self.mean = positions.mean(axis=0)
        kernel = self.kernel(self.times) + NOISE ** 2 * np.eye(len(stamps))
        self.weights = cho_solve(cho_factor(kernel), positions - self.mean)

    def kernel(self, times):
        return np.exp(-0.5 * ((times[:, None] - self.times) / LENGTH) ** 2)

    def poses(self, stamps):
        positions = self.mean + self.kernel((stamps - self.oldest) * 1e-9) @ self.weights
        return np.concatenate([positions, np.tile([0.0, 0.0, 0.0, 1.0], (len(stamps), 1))], axis=1)

    def twists(self, stamps):
        times = (stamps - self.oldest) * 1e-9
        slopes = -(times[:, None] - self.times) / LENGTH ** 2 * self.kernel(times)
        return np.concatenate([slopes @ self.weights, np.zeros((len(stamps), 3))], axis=1)


def flight(times):
    """Return the true positions of the drone (N, 3): two loops of a figure eight."""
    angle = 1.5 * times
    return np.stack([2.0 * np.sin(angle), np.sin(2.0 * angle), 1.0 + 0.2 * angle], axis=1)


def main():
    """Fit the process, insert it into a tree, and look up poses between the tracker's samples."""
    times = np.arange(0.0, 8.0, 0.1)
    stamps = from_seconds(times)
    measured = flight(times) + np.random.default_rng(1).normal(0.0, NOISE, (len(times), 3))

    buffer = BufferCore()
    buffer.insert_curve('world', 'drone', GaussianProcess(stamps, measured))
    buffer.insert('drone', 'camera', 0, Pose.from_xyz_rpy(x=0.1, pitch=0.5), static=True)

    asked = from_seconds(np.arange(0.5, 7.0, 0.001))
    world_T_drone = buffer.lookup_many('world', 'drone', asked)
    errors = np.linalg.norm(world_T_drone[:, :3] - flight(asked * 1e-9), axis=1)
    samples = BufferCore(cache_time=from_seconds(10.0))
    samples.insert_track('world', 'drone', stamps, [Pose(*position) for position in measured])
    straight = samples.lookup_many('world', 'drone', asked)
    of_lines = np.linalg.norm(straight[:, :3] - flight(asked * 1e-9), axis=1)
    print(f'mean error of linear interpolation {1e3 * of_lines.mean():.1f} mm, '
          f'of the process {1e3 * errors.mean():.1f} mm')

    velocity = lookup_twist(buffer, 'drone', 'world', from_seconds(2.0), from_seconds(0.1))
    real = (flight(np.array([2.0 + 1e-6])) - flight(np.array([2.0 - 1e-6])))[0] / 2e-6
    print(f'velocity at 2 s: {np.round(velocity.linear, 2)} m/s, true value {real.round(2)}')
    camera_T_world = buffer.lookup('camera', 'world', from_seconds(2.0345))
    print('the camera sees the origin of the world at', np.round(camera_T_world @ [0, 0, 0], 2))


if __name__ == '__main__':
    main()
