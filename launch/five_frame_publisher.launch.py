# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Publish a robot of five frames: ros2 launch tf_tree_py five_frame_publisher.launch.py."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    defaults = PathJoinSubstitution(
        [FindPackageShare('tf_tree_py'), 'config', 'five_frames.yaml'])
    use_sim_time = ParameterValue(LaunchConfiguration('use_sim_time'), value_type=bool)
    return LaunchDescription([
        DeclareLaunchArgument(
            'params_file', default_value=defaults, description='YAML file of parameters'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', description='go by the time on /clock'),
        DeclareLaunchArgument(
            'namespace', default_value='',
            description="the node's; /tf and /tf_static are the same in every namespace"),
        Node(
            package='tf_tree_py',
            executable='five_frame_publisher',
            name='five_frame_publisher',
            namespace=LaunchConfiguration('namespace'),
            parameters=[LaunchConfiguration('params_file'), {'use_sim_time': use_sim_time}],
            output='screen',
        ),
    ])
