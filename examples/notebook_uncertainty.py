# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Run it as a whole, `python3 examples/notebook_uncertainty.py [BAG]`, or cell by cell in an editor
# that supports "# %%". It needs rosbags and matplotlib, and no ROS. Without a bag it makes one.
"""The uncertainty of a camera's pose, from a bag with amcl_pose and odometry to a picture."""

# %% [markdown]
# This cell only makes a bag of a robot that drives: /tf, /tf_static, /amcl_pose, /odometry, and
# the covariance of the camera's mounting. If you have a bag, pass it, and skip this cell.

# %%
from pathlib import Path
import sys

from matplotlib.patches import Ellipse
import matplotlib.pyplot as plt
import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from tf_tree_py import from_seconds, Pose
from tf_tree_py.bag import Covariances, open_bag

START = 1_700_000_000
TYPES = get_typestore(Stores.ROS2_JAZZY)


def message(kind, *fields):
    return TYPES.types[kind.replace('/', '/msg/')](*fields)


def header(second, frame):
    time = message('builtin_interfaces/Time', *divmod(from_seconds(START + second), 10**9))
    return message('std_msgs/Header', time, frame)


def transform(second, parent, child, pose):
    values = message('geometry_msgs/Transform', message('geometry_msgs/Vector3', *pose[:3]),
                     message('geometry_msgs/Quaternion', *pose[3:]))
    return message('geometry_msgs/TransformStamped', header(second, parent), child, values)


def uncertain(pose, covariance):
    values = message('geometry_msgs/Pose', message('geometry_msgs/Point', *pose[:3]),
                     message('geometry_msgs/Quaternion', *pose[3:]))
    return message('geometry_msgs/PoseWithCovariance', values, covariance.ravel())


def odometry(second, parent, child, pose, covariance):
    nothing = message('geometry_msgs/Vector3', 0.0, 0.0, 0.0)
    twist = message('geometry_msgs/TwistWithCovariance', message(
        'geometry_msgs/Twist', nothing, nothing), np.zeros(36))
    return message('nav_msgs/Odometry', header(second, parent), child,
                   uncertain(pose, covariance), twist)


def spread(along, across, turn, heading):
    """Return a covariance from standard deviations on the floor, as drivers publish it."""
    c, s = np.cos(heading), np.sin(heading)
    covariance = np.diag([0.0, 0.0, 1e6, 1e6, 1e6, turn ** 2])
    turned = np.array([[c, -s], [s, c]])
    covariance[:2, :2] = turned @ np.diag([along ** 2, across ** 2]) @ turned.T
    return covariance


def drive(second):
    """Yield the messages at a time, as (topic, type, message): half a lap around the block."""
    heading = np.pi * second / 30.0
    robot = Pose.from_xyz_rpy(x=6.0 * np.sin(heading), y=6.0 - 6.0 * np.cos(heading), yaw=heading)
    slip = Pose.from_xyz_rpy(x=0.01 * second, y=-0.02 * second, yaw=0.002 * second)
    odom_T_base = slip @ robot
    # Halfway there is only a long wall, along which the position cannot be determined.
    along, across, turn = 0.05 + 0.35 * np.sin(heading) ** 4, 0.05, np.radians(1.0)
    off = Pose.from_xyz_rpy(x=0.5 * along * np.sin(0.3 * second), y=0.5 * across)
    amcl = robot @ off
    yield '/tf', 'tf2_msgs/TFMessage', message('tf2_msgs/TFMessage', [
        transform(second, 'map', 'odom', amcl @ odom_T_base.inverse()),
        transform(second, 'odom', 'base_link', odom_T_base)])
    grown = spread(0.01 + 0.02 * second, 0.01 + 0.02 * second, 0.004 * second, heading)
    yield '/odometry', 'nav_msgs/Odometry', odometry(
        second, 'odom', 'base_link', odom_T_base, grown)
    if second % 0.5 == 0.0:
        yield '/amcl_pose', 'geometry_msgs/PoseWithCovarianceStamped', message(
            'geometry_msgs/PoseWithCovarianceStamped', header(second, 'map'),
            uncertain(amcl, spread(along, across, turn, heading)))


def mounting():
    """Yield the static messages of the camera, like static_transform_publisher."""
    base_T_camera, known = Pose(x=1.5, z=1.2), np.diag([9e-4, 9e-4, 9e-4, 1e-4, 1e-4, 1e-4])
    yield '/tf_static', 'tf2_msgs/TFMessage', message('tf2_msgs/TFMessage', [
        transform(0.0, 'base_link', 'camera', base_T_camera)])
    yield '/tf_static_covariance', 'nav_msgs/Odometry', odometry(
        0.0, 'base_link', 'camera', base_T_camera, known)


def recorded(path):
    """Return the path of a bag with 30 s of the drive; write the bag if it does not exist."""
    if Path(path).exists():
        return path
    topics = {}
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for second in np.arange(0.0, 30.01, 0.1).round(1).tolist():
            for topic, kind, sent in [*(mounting() if second == 0.0 else ()), *drive(second)]:
                name = kind.replace('/', '/msg/')
                if topic not in topics:
                    topics[topic] = writer.add_connection(topic, name, typestore=TYPES)
                writer.write(topics[topic], from_seconds(START + second),
                             TYPES.serialize_cdr(sent, name))
    return path


is_given = len(sys.argv) > 1 and 'ipykernel' not in sys.modules
path = sys.argv[1] if is_given else recorded('uncertain_drive')

# %% [markdown]
# From the bag to the camera's trajectory and its uncertainty. A localisation publishes the
# covariance of the robot's pose in the map, but it corrects map -> odom: that edge is uncertain.
# `planar` is set because drivers give a variance of 1e6 to the directions in which a robot on a
# floor cannot move. The covariance of the camera's mounting is also in the bag
# (/tf_static_covariance), and is found automatically.

# %%
buffer = open_bag(path, covariances={
    '/amcl_pose': Covariances(child='base_link', edge=('map', 'odom'), planar=True)})
moving = [edge for edge in buffer.edges_between('map', 'camera') if not edge.static]
stamps = np.linspace(max(edge.oldest for edge in moving), min(edge.latest for edge in moving),
                     100).astype(np.int64)
poses, covariances = buffer.lookup_uncertain_many('map', 'camera', stamps)


# %% [markdown]
# The ellipse of two standard deviations on the floor: its axes are the eigenvectors.

# %%
def draw(axes, poses, covariances, color, label, **style):
    axes.plot(poses[:, 0], poses[:, 1], color=color, label=label)
    for pose, covariance in zip(poses[::4], covariances[::4], strict=True):
        variances, ways = np.linalg.eigh(covariance[:2, :2])
        axes.add_patch(Ellipse(pose[:2], *(2.0 * 2.0 * np.sqrt(variances)), color=color, **style,
                               angle=np.degrees(np.arctan2(ways[1, 0], ways[0, 0]))))


figure, axes = plt.subplots(figsize=(8.0, 8.0))
draw(axes, poses, covariances, 'tab:blue', 'camera in map, localised', alpha=0.4)

# %% [markdown]
# The edges that cause the uncertainty where it is largest.

# %%
worst = int(np.trace(covariances[:, :2, :2], axis1=1, axis2=2).argmax())
for name, number in ('At the beginning', 0), ('Where it is least certain', worst):
    sigma = np.sqrt(np.linalg.eigvalsh(covariances[number, :2, :2])[-1])
    print(f"{name}, the error of the camera's position is up to {2.0 * sigma:.2f} m (2 sigma):")
    for share in buffer.lookup_budget('map', 'camera', int(stamps[number])):
        print(f'    {share.parent} -> {share.child} adds {share.position:.0%}')

# %% [markdown]
# Without the localisation, odometry alone drifts, and its covariance grows. The bag is opened a
# second time on purpose: map -> odom compensates for the drift of the odometry, so their errors
# must not be added.

# %%
alone = open_bag(path, covariances={'/odometry': Covariances(planar=True)})
poses, covariances = alone.lookup_uncertain_many('odom', 'camera', stamps)
draw(axes, poses, covariances, 'tab:orange', 'camera in odom, by odometry alone', fill=False,
     alpha=0.6)
sigma = np.sqrt(np.linalg.eigvalsh(covariances[-1, :2, :2])[-1])
print(f'With odometry alone, the error at the end is up to {2.0 * sigma:.2f} m (2 sigma)')

axes.set(xlabel='x / m', ylabel='y / m', title='The camera, and 2 sigma of its position')
axes.axis('equal')
axes.legend()
figure.savefig('camera_uncertainty.png')
