# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The robot of five frames and its listeners: ros2 launch tf_tree_py five_frames.launch.py."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare('tf_tree_py')


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription([
        DeclareLaunchArgument(
            'params_file',
            default_value=PathJoinSubstitution([SHARE, 'config', 'five_frames.yaml']),
            description='YAML file of parameters, of both nodes'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', description='go by the time on /clock'),
        DeclareLaunchArgument(
            'namespace', default_value='',
            description="the nodes'; /tf and /tf_static are the same in every namespace"),
        DeclareLaunchArgument(
            'rviz', default_value='false', description='show the frames in RViz, too'),
        include('five_frame_publisher.launch.py'),
        include('five_frame_listener.launch.py'),
        Node(
            package='rviz2',
            executable='rviz2',
            arguments=['-d', PathJoinSubstitution([SHARE, 'rviz', 'five_frames.rviz'])],
            parameters=[{'use_sim_time': ParameterValue(
                LaunchConfiguration('use_sim_time'), value_type=bool)}],
            condition=IfCondition(LaunchConfiguration('rviz')),
        ),
    ])


def include(name: str) -> IncludeLaunchDescription:
    """Return the inclusion of a launch file of this folder, with the arguments of this one."""
    arguments = ('params_file', 'use_sim_time', 'namespace')
    return IncludeLaunchDescription(
        PythonLaunchDescriptionSource(PathJoinSubstitution([SHARE, 'launch', name])),
        launch_arguments=[(argument, LaunchConfiguration(argument)) for argument in arguments])
