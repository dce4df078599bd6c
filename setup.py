from glob import glob
from pathlib import Path
import shutil

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

package_name = 'tf_tree_py'

executables = [
    'buffer_server',
    'edge_switch',
    'five_frame_demo',
    'five_frame_listener',
    'five_frame_publisher',
    'relocalisation_anchor',
    'robot_state_publisher',
    'static_transform_publisher',
    'tf_relay',
    'urdf_broadcaster',
]

tools = [
    'tf_archive',
    'tf_audit',
    'tf_doctor',
    'tf_echo',
    'tf_export',
    'tf_frames',
    'tf_monitor',
    'tf_record',
]


class BuildAfresh(build_py):
    """Build without what an earlier build has left, such as modules that were deleted since."""

    def run(self) -> None:
        """Take away this package's earlier build, and build; `build/` would go into the wheel."""
        earlier = Path(self.build_lib, package_name)
        if not self.editable_mode and earlier.is_dir() and not earlier.is_symlink():
            shutil.rmtree(earlier)
        super().run()


setup(
    name=package_name,
    cmdclass={'build_py': BuildAfresh},
    version='0.1.0',
    description='The transform tree of ROS 2, tf2, in pure Python.',
    maintainer='tf_tree_py maintainers',
    maintainer_email='maintainers@users.noreply.github.com',
    license='Apache-2.0',
    packages=find_packages(include=[package_name, f'{package_name}.*']),
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*')),
        (f'share/{package_name}/rviz', glob('rviz/*')),
    ],
    zip_safe=True,
    python_requires='>=3.10',
    # rclpy and the messages come with ROS 2; what needs no ROS needs no more than this.
    install_requires=['numpy', 'scipy'],
    extras_require={
        'archive': ['distributed', 'jinja2', 'rich', 'rosbags>=0.11'],
        'bag': ['rich', 'rosbags>=0.11'],
        'export': ['pandas', 'pyarrow'],
        'fleet': ['eclipse-zenoh>=1.10'],
        'plot': ['matplotlib'],
        'tools': ['rich', 'rosbags>=0.11'],
        'test': ['hypothesis', 'pytest'],
        'view': ['pycollada', 'trimesh', 'viser>=1.1'],
        'xacro': ['xacro'],
    },
    entry_points={
        'console_scripts': [
            *(f'{name} = {package_name}.nodes.starting:{name}' for name in executables),
            *(f'{name} = {package_name}.tools.{name}:main' for name in tools),
            f'tf_view = {package_name}.view.tf_view:main',
            f'view_frames = {package_name}.tools.tf_frames:view_frames',
            f'tf_lab = {package_name}.labs.tf_lab:main',
        ],
        # `ros2 tf echo` and its kin, where there is a ros2 command.
        'ros2cli.command': [f'tf = {package_name}.tools.ros2_verbs:TfCommand'],
        'ros2cli.extension_point': [
            f'{package_name}.verb = {package_name}.tools.ros2_verbs:VerbExtension'],
        f'{package_name}.verb': [
            f'{name.removeprefix("tf_")} = {package_name}.tools.ros2_verbs:'
            f'{name.removeprefix("tf_").title()}Verb' for name in tools],
    },
)
