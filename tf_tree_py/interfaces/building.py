# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Builds tf2_msgs from its definitions, with a C++ compiler and the generators in the wheels.

The result is a Python package with one extension module, which is also the libraries that
``rosidl_typesupport_c`` loads by name. It is for rclpy with Fast DDS: it has no type support for
C++, and nothing that other packages could compile against.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import os
from pathlib import Path
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile

import numpy as np

from .generating import DEFINITIONS, definitions, PACKAGE, TYPE_SUPPORTS
from .kept import Kept
from .type_hashes import differing, TYPE_HASHES

_END_OF_LOG = 3000


class CannotBuild(Exception):
    """A requirement of the build is missing, or the build failed."""


def find() -> Path | None:
    """Return the folder that contains tf2_msgs: in a sourced ROS 2, or in this environment."""
    sourced = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    for prefix in (*filter(None, sourced), sys.prefix):
        if Path(prefix, 'share', PACKAGE, 'package.xml').is_file():
            return Path(prefix)
    return None


def _demand_what_it_takes(prefix: Path) -> None:
    """
    Check that the environment and the machine meet the requirements of the build.

    :raises CannotBuild: a requirement is missing; the text names what to install.
    """
    if not (prefix / 'share' / 'rosidl_generator_py').is_dir():
        raise CannotBuild(
            f"{prefix} has no wheels of ROS 2. To install them, run pip install '.[jazzy]' (or "
            "'.[kilted]') in a checkout of this package, in a venv of Python 3.10 to 3.14. Where "
            'ROS 2 is installed by its packages: source it, and sudo apt install '
            'ros-$ROS_DISTRO-tf2-msgs')
    if shutil.which(_compiler()[0]) is None:
        raise CannotBuild(
            f'the build needs a C++ compiler, and there is no {_compiler()[0]}: sudo apt install '
            'g++')
    if not Path(sysconfig.get_paths()['include'], 'Python.h').is_file():
        raise CannotBuild("the build needs Python's headers: sudo apt install "
                          f'python{sysconfig.get_python_version()}-dev')


def sources() -> list[Path]:
    """Return the files that determine a build, besides the wheels: ours."""
    folder = Path(__file__).parent
    return [*folder.glob('*.py'), DEFINITIONS / 'package.xml',
            *(DEFINITIONS / file for file in definitions())]


def build(prefix: Path, kept: Kept | None = None,
          report: Callable[[str], None] = lambda _: None) -> None:
    """
    Build tf2_msgs into an environment that has the wheels of ROS 2, or copy an earlier build.

    :param prefix: the folder of the environment; its Python is the one that runs.
    :param kept: where earlier builds are kept; by default nowhere.
    :param report: gets a line for a person: what is done now.
    :raises CannotBuild: a requirement is missing, the build failed, or its types are not those
        of Jazzy. Then nothing is installed.
    """
    earlier = kept.find() if kept else None
    if earlier and not _fault_of(earlier, prefix):
        report(f'copying it from {earlier} into {prefix}')
        _install(earlier, prefix)
        return
    _demand_what_it_takes(prefix)
    report(f'building it into {prefix}, which takes about five seconds')
    with tempfile.TemporaryDirectory(prefix=f'{PACKAGE}_') as folder:
        generated, image = Path(folder, 'generated'), Path(folder, 'image')
        _run(sys.executable, '-m', f'{__package__}.generating', str(generated), prefix=prefix)
        _lay_out(generated, image)
        _compile(generated, image, prefix)
        if fault := _fault_of(image, prefix):
            raise CannotBuild(f'it was built, but {fault}')
        _install(image, prefix)
        if kept:
            kept.keep(image)


# --- the image: what an environment gets, in the folders python, lib and share

def _lay_out(generated: Path, image: Path) -> None:
    """Copy all that is not compiled from the generated files."""
    shutil.copytree(generated / 'py' / PACKAGE, image / 'python' / PACKAGE,
                    ignore=shutil.ignore_patterns('*.c'))
    (image / 'python' / PACKAGE / '__init__.py').touch()
    share = image / 'share' / PACKAGE
    for subfolder in {file.parent for file in definitions()}:
        shutil.copytree(generated / subfolder, share / subfolder)
        shutil.copytree(DEFINITIONS / subfolder, share / subfolder, dirs_exist_ok=True)
    shutil.copy(DEFINITIONS / 'package.xml', share)
    names = sorted(str(file.with_suffix(suffix))
                   for file in definitions() for suffix in (file.suffix, '.idl'))
    for resource, content in (('packages', ''), ('rosidl_interfaces', '\n'.join(names))):
        (image / _INDEX / resource).mkdir(parents=True)
        (image / _INDEX / resource / PACKAGE).write_text(content)


def _install(image: Path, prefix: Path) -> None:
    """Copy an image into an environment; package.xml, which ``find`` looks for, comes last."""
    folder = Path(sysconfig.get_path('platlib', vars={'platbase': str(prefix)}))
    shutil.copytree(image / 'python', folder, dirs_exist_ok=True)
    _link(folder, prefix / 'lib')
    manifest = Path('share', PACKAGE, 'package.xml')
    shutil.copytree(image / 'share', prefix / 'share', dirs_exist_ok=True,
                    ignore=shutil.ignore_patterns(manifest.name))
    shutil.copy(image / manifest, prefix / manifest)


def _module(folder: Path) -> Path:
    """Return the extension module below a folder of Python packages."""
    suffix = sysconfig.get_config_var('EXT_SUFFIX')
    return folder / PACKAGE / f'{PACKAGE}_s__rosidl_typesupport_c{suffix}'


def _link(python: Path, libraries: Path) -> None:
    """Give the module the names by which the type supports are loaded."""
    libraries.mkdir(exist_ok=True)
    for type_support in TYPE_SUPPORTS:
        link = libraries / _library(type_support)
        link.unlink(missing_ok=True)
        link.symlink_to(os.path.relpath(_module(python), libraries))


def _library(type_support: str) -> str:
    return f'lib{PACKAGE}__{type_support}.so'


_INDEX = Path('share', 'ament_index', 'resource_index')
_FILES = [Path('share', PACKAGE, 'package.xml'), _INDEX / 'packages' / PACKAGE,
          _INDEX / 'rosidl_interfaces' / PACKAGE,
          *(Path('share', PACKAGE, file) for file in definitions())]
"""Of an image, besides what is loaded and the descriptions of the types."""

_LOAD = """
import ctypes
import importlib
for library in {libraries}:
    ctypes.CDLL(library)
for name in {names}:
    package, subfolder, name = name.split('/')
    type_ = getattr(importlib.import_module(f'{{package}}.{{subfolder}}'), name)
    type(type_).__import_type_support__()
    assert type(type_)._TYPE_SUPPORT is not None
"""


def _fault_of(image: Path, prefix: Path) -> str:
    """Return what is wrong with an image, which may be damaged; nothing if it can be installed."""
    try:
        wrong = differing(image)
    except (ValueError, LookupError) as error:
        wrong = [str(error)]
    if wrong:
        return f'differs from that of ROS 2 Jazzy in these types: {", ".join(wrong)}'
    if missing := [str(path) for path in _FILES if not (image / path).is_file()]:
        return f'lacks {", ".join(missing)}'
    program = _LOAD.format(names=list(TYPE_HASHES), libraries=[*map(_library, TYPE_SUPPORTS)])
    paths = {name: os.pathsep.join((str(image / folder), os.environ.get(name, '')))
             for name, folder in (('PYTHONPATH', 'python'), ('LD_LIBRARY_PATH', 'lib'))}
    try:
        # All symbols are resolved at once.
        _run(sys.executable, '-c', program, prefix=prefix, LD_BIND_NOW='1', **paths)
    except CannotBuild as error:
        return f'does not load:\n{error}'
    return ''


# --- compiling

_LINKED_PACKAGES = ('action_msgs', 'builtin_interfaces', 'geometry_msgs', 'service_msgs',
                    'unique_identifier_msgs')
_LINKED_PARTS = ('rosidl_generator_c', 'rosidl_generator_py', 'rosidl_typesupport_c',
                 *TYPE_SUPPORTS)
_LINKED = ('fastcdr', 'rcutils', 'rmw', 'rosidl_runtime_c', 'rosidl_typesupport_c',
           'rosidl_typesupport_fastrtps_cpp', *TYPE_SUPPORTS,
           *(f'{package}__{part}' for package in _LINKED_PACKAGES for part in _LINKED_PARTS))


def _compile(sources: Path, image: Path, prefix: Path) -> None:
    """Compile the generated sources to the extension module that rclpy imports."""
    headers = (*sources.iterdir(), Path(sysconfig.get_paths()['include']), np.get_include(),
               prefix / 'include', *sorted((prefix / 'include').iterdir()))
    options = ['-O1', '-fPIC', '-w', *(f'-I{folder}' for folder in headers)]

    def compiled(unit: Path) -> str:
        language = 'c' if unit.suffix == '.c' else 'c++'
        _run(*_compiler(), '-x', language, *options, '-c', str(unit), '-o', f'{unit}.o',
             prefix=prefix)
        return f'{unit}.o'

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        objects = list(threads.map(compiled, _units(sources)))
    python = image / 'python'
    _run(*_compiler(), '-shared', '-o', str(_module(python)), *objects, f'-L{prefix / "lib"}',
         '-Wl,--as-needed', *(f'-l{library}' for library in _LINKED), prefix=prefix)
    _link(python, image / 'lib')


def _units(sources: Path) -> list[Path]:
    """
    Write files that include the generated ones, for the compiler to read each header once.

    That takes a quarter of the time. All C++ is one unit, which takes longest and comes first.
    The C of several interfaces cannot be one, because it has static names in common.
    """
    parts = {'all.cpp': [*sources.rglob('*.cpp')],
             'module.c': [*sources.glob(f'py/{PACKAGE}/*.c')]}
    for functions in sources.rglob('*__functions.c'):
        name = functions.name.removesuffix('__functions.c')
        parts[f'{name}.c'] = [*sources.rglob(f'{name}__*.c'), *sources.rglob(f'_{name}_s.c')]
    for unit, included in parts.items():
        text = ''.join(f'#include "{file}"\n' for file in sorted(included))
        (sources / unit).write_text(text)
    return [sources / unit for unit in parts]


def _compiler() -> list[str]:
    named = os.environ.get('CXX', '')
    try:
        return shlex.split(named) or ['c++']
    except ValueError as error:
        raise CannotBuild(f'CXX={named} cannot be split into words: {error}') from None


def _run(*command: str, prefix: Path, **variables: str) -> None:
    # Only this environment is searched.
    environment = {**os.environ, 'AMENT_PREFIX_PATH': str(prefix), **variables}
    done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    if done.returncode:
        raise CannotBuild(
            f'{shlex.join(command)[:200]} failed:\n{done.stdout[-_END_OF_LOG:]}')
