# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Broadcast a robot's URDF as transforms: ros2 launch tf_tree_py urdf_broadcaster.launch.py."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

CONFIG = [FindPackageShare('tf_tree_py'), 'config']


def generate_launch_description() -> LaunchDescription:
    use_sim_time = ParameterValue(LaunchConfiguration('use_sim_time'), value_type=bool)
    return LaunchDescription([
        DeclareLaunchArgument(
            'urdf', default_value=PathJoinSubstitution([*CONFIG, 'five_frames.urdf']),
            description='file of the robot, URDF or .xacro; it is watched for edits'),
        DeclareLaunchArgument(
            'params_file', default_value=PathJoinSubstitution([*CONFIG, 'five_frames.yaml']),
            description='YAML file of parameters'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', description='go by the time on /clock'),
        DeclareLaunchArgument(
            'namespace', default_value='',
            description="the node's; /tf and /tf_static are the same in every namespace"),
        Node(
            package='tf_tree_py',
            executable='urdf_broadcaster',
            name='urdf_broadcaster',
            namespace=LaunchConfiguration('namespace'),
            arguments=['--urdf', LaunchConfiguration('urdf')],
            parameters=[LaunchConfiguration('params_file'), {'use_sim_time': use_sim_time}],
            output='screen',
        ),
    ])
