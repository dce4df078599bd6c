from glob import glob
import os
from pathlib import Path
import re
import shutil
import sys
import sysconfig
from xml.etree import ElementTree

from setuptools import Extension, find_packages, setup
from setuptools.command.build_py import build_py

# colcon runs a link to this file.
repository = Path(__file__).resolve().parent
# Whose the package is, and what, stands there; the version, which bloom writes, there and here.
manifest = ElementTree.parse(repository / 'package.xml').getroot()
package_name = manifest.findtext('name')
urls = {url.get('type', 'website').capitalize(): url.text for url in manifest.findall('url')}

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
    'tf_share',
    'urdf_broadcaster',
]

tools = [
    'tf_archive',
    'tf_audit',
    'tf_calibrate',
    'tf_doctor',
    'tf_echo',
    'tf_export',
    'tf_frames',
    'tf_monitor',
    'tf_record',
]

# What needs no ROS needs numpy and scipy alone; each extra is for one part more.
bag = ['rich>=13', 'rosbags>=0.11']
plot = ['matplotlib>=3.6']
pandas = 'pandas>=2.1'
view = ['pillow>=9.1', 'pycollada>=0.7', 'trimesh>=4', 'viser>=1.1']
test = ['hypothesis>=6.98', 'pytest>=7.4', 'pytest-xdist>=3.5']
extras = {
    'archive': [*bag, 'distributed>=2023.12', 'jinja2>=3.1'],
    'bag': bag,
    'export': ['mcap>=1.1', pandas, 'pyarrow>=14'],
    'fleet': ['eclipse-zenoh>=1.10'],
    # Its code needs a newer protobuf than its metadata says.
    'foxglove': [*bag, 'foxglove-schemas-protobuf>=0.4', 'protobuf>=5.29.6'],
    'notebook': [*bag, *plot, pandas, 'ipykernel>=6'],
    'plot': plot,
    'rerun': ['rerun-sdk>=0.30'],
    'test': test,
    'tools': bag,
    'view': view,
    'xacro': ['xacro>=2'],
}
extras['dev'] = sorted({
    *(requirement for extra in extras.values() for requirement in extra), 'mypy', 'ruff'})
# ROS 2 itself as wheels, for Linux on x86_64 and Python 3.10 to 3.14, and the generators with
# which `python -m tf_tree_py.interfaces` builds tf2_msgs, which is in none. The wheels do not name
# all of their needs.
wheels = [
    'rclpy',
    'rmw-fastrtps-cpp',
    'common-interfaces',
    'rosidl-adapter',
    'rosidl-generator-c',
    'rosidl-generator-py',
    'rosidl-generator-type-description',
    'rosidl-typesupport-c',
    'rosidl-typesupport-fastrtps-c',
    'rosidl-typesupport-introspection-c',
]
for distro in ('jazzy', 'kilted'):
    extras[distro] = [*(f'ros-{distro}-{name}' for name in wheels), 'empy<4', 'pyyaml']


class BuildAfresh(build_py):
    """Build without what an earlier build has left, such as modules that were deleted since."""

    def run(self) -> None:
        """Take away this package's earlier build, and build; `build/` would go into the wheel."""
        earlier = Path(self.build_lib, package_name)
        if not self.editable_mode and earlier.is_dir() and not earlier.is_symlink():
            shutil.rmtree(earlier)
        super().run()


def can_compile() -> bool:
    """Return whether there are a C compiler and Python's headers."""
    compiler, *_ = f'{os.environ.get("CC", sysconfig.get_config_var("CC") or "")} cc'.split()
    return os.name == 'nt' or (shutil.which(compiler) is not None and Path(
        sysconfig.get_path('include'), 'Python.h').exists())


def extensions() -> 'list[Extension]':
    """
    Return the formulas of lookups in C, or nothing where Python computes them.

    If the compiler fails, setuptools warns, and goes on without an optional extension.
    """
    if (os.environ.get('TF_TREE_PY_PURE', '0') not in ('', '0')
            or sys.implementation.name != 'cpython'
            or sysconfig.get_config_var('Py_GIL_DISABLED') or not can_compile()):
        return []
    # Otherwise compilers for ARM round a product and a sum once, where Python rounds twice.
    exact = ['-ffp-contract=off']
    if sys.platform == 'darwin':
        # It computes the sine and the cosine of an angle together, maybe with other last bits.
        exact += ['-fno-builtin-sin', '-fno-builtin-cos']
    in_c = f'{package_name}.core.tree.path_in_c'
    return [Extension(in_c, [f'{in_c.replace(".", "/")}.c'], optional=True,
                      extra_compile_args=[] if os.name == 'nt' else exact)]


def as_read_elsewhere(readme: str) -> str:
    """
    Return the README with the full address of what it links to and shows.

    While package.xml has no ``<url type="repository">`` there is no such address: links
    become plain words, and pictures are left out.
    """
    def replaced(link: 're.Match[str]') -> str:
        picture, words, path = link.groups()
        if 'Repository' not in urls:
            return '' if picture else words
        kind = 'raw' if picture else 'blob'
        page = 'README.md' if path.startswith('#') else ''
        return f'{picture}[{words}]({urls["Repository"]}/{kind}/HEAD/{page}{path})'

    return re.sub(r'(!?)\[([^]]+)\]\((?!\w+:)([^)]+)\)', replaced, readme)


setup(
    name=package_name,
    cmdclass={'build_py': BuildAfresh},
    ext_modules=extensions(),
    version='0.1.0',
    description=manifest.findtext('description'),
    long_description=as_read_elsewhere((repository / 'README.md').read_text(encoding='utf-8')),
    long_description_content_type='text/markdown',
    author=manifest.findtext('author'),
    maintainer=manifest.findtext('maintainer'),
    maintainer_email=manifest.find('maintainer').get('email'),
    # setuptools finds the file LICENSE by itself. `colcon build --symlink-install` does not link
    # it, and setuptools warns of a file that is named here but missing.
    license=manifest.findtext('license'),
    project_urls=urls,
    keywords=['ROS 2', 'tf2', 'transforms', 'robotics'],
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Developers',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        *(f'Programming Language :: Python :: {version}'
          for version in ('3', '3 :: Only', '3.10', '3.11', '3.12', '3.13', '3.14')),
        'Topic :: Scientific/Engineering',
        'Typing :: Typed',
    ],
    packages=find_packages(include=[package_name, f'{package_name}.*']),
    package_data={
        package_name: ['py.typed', 'view/page/*.js', 'interfaces/tf2_msgs/*.*',
                       'interfaces/tf2_msgs/*/*', 'core/tree/path_in_c.pyi']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*')),
        (f'share/{package_name}/launch', glob('launch/*')),
        (f'share/{package_name}/rviz', glob('rviz/*')),
    ],
    zip_safe=False,
    python_requires='>=3.10',
    # The oldest are those of Ubuntu 24.04, with which scripts/test --oldest runs.
    install_requires=['numpy>=1.26', 'scipy>=1.11'],
    extras_require=extras,
    entry_points={
        'console_scripts': [
            *(f'{name} = {package_name}.nodes.starting:{name}' for name in executables),
            *(f'{name} = {package_name}.tools.starting:{name}'
              for name in [*tools, 'view_frames']),
            f'tf_view = {package_name}.view.starting:tf_view',
            f'tf_lab = {package_name}.labs.starting:tf_lab',
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
