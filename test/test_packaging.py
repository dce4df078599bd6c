# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The installed package: the wheel, its metadata, and the manifest's dependencies."""

import ast
from importlib.metadata import distribution, metadata
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
from xml.etree import ElementTree
import zipfile

from programs import completed, PATIENCE_S
import pytest
from standin import standin_env
import tf_tree_py
from tf_tree_py.command.arguments import Parser
from tf_tree_py.core import COMPILED

REPOSITORY = Path(__file__).resolve().parents[1]
REQUIREMENTS = REPOSITORY / 'scripts' / 'requirements'
PACKAGE = distribution('tf_tree_py')
MANIFEST = ElementTree.parse(REPOSITORY / 'package.xml')
ADDRESS = 'https://example.org/somebody/tf_tree_py'

NOT_SOURCES = shutil.ignore_patterns('__pycache__', '*.so')

LINK = re.compile(r'(!?)\[[^]]+\]\(([^)#]*)[^)]*\)')


def requirements(extra=''):
    """Return the declared requirements of the package, or of an extra."""
    ending = f'; extra == "{extra}"' if extra else ''
    return {text.removesuffix(ending).replace(' ', '') for text in PACKAGE.requires
            if (text.endswith(ending) if extra else 'extra ==' not in text)}


def test_manifest_and_setup_name_one_version():
    assert tf_tree_py.__version__ == PACKAGE.version == MANIFEST.findtext('version')


def test_every_program_says_its_version_and_whether_its_formulas_are_compiled(capsys):
    with pytest.raises(SystemExit) as ended:
        Parser('program', 'It does nothing.').parse(['--version'])
    how = 'compiled formulas' if COMPILED else 'pure Python'
    assert (ended.value.code, *capsys.readouterr()) == (
        0, f'tf_tree_py {PACKAGE.version} ({how})\n', '')


@pytest.mark.parametrize(('variables', 'how'), [
    ({'CC': 'no-such-compiler -O2'}, 'pure Python'), ({'CC': 'false'}, 'pure Python'),
    ({'TF_TREE_PY_PURE': '1'}, 'pure Python'), ({}, 'compiled formulas')])
def test_package_is_built_with_and_without_a_compiler(variables, how, tmp_path):
    environment = {name: value for name, value in os.environ.items()
                   if name not in ('CC', 'PYTHONPATH', 'TF_TREE_PY_PURE')}
    done = completed(sys.executable, 'setup.py', 'build', '--build-lib', tmp_path / 'built',
                     cwd=copied_sources(tmp_path), env={**environment, **variables})
    assert done.returncode == 0, done.stderr
    has_headers = Path(sysconfig.get_path('include'), 'Python.h').exists()
    assert ('failed' in done.stdout + done.stderr) == (
        has_headers and variables == {'CC': 'false'})
    if not variables and not [*tmp_path.glob('built/tf_tree_py/core/tree/*.so')]:
        pytest.skip('needs a C compiler and the headers of Python')
    said = completed(sys.executable, '-c', 'from tf_tree_py.command.arguments import Parser; '
                     'Parser("program", "").parse(["--version"])', cwd=tmp_path,
                     env={**environment, 'PYTHONPATH': str(tmp_path / 'built')})
    assert (said.stdout.strip().partition('(')[2], said.stderr) == (f'{how})', '')


def test_package_that_is_not_installed_has_no_version(tmp_path):
    program = 'import tf_tree_py; print(hasattr(tf_tree_py, "__version__"), len(dir(tf_tree_py)))'
    shutil.copytree(REPOSITORY / 'tf_tree_py', tmp_path / 'tf_tree_py',
                    ignore=shutil.ignore_patterns('__pycache__'))
    done = subprocess.run(
        [sys.executable, '-S', '-c', f'import sys; sys.path[1:] = [path for path in sys.path[1:] '
         f'if "tf_tree_py" not in path]; {program}'], cwd=tmp_path,
        capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert done.stdout.startswith('False '), done.stdout


@pytest.mark.parametrize(
    'executable', PACKAGE.entry_points.select(group='console_scripts'), ids=lambda e: e.name)
def test_executable_has_a_main(executable):
    assert callable(executable.load())


def copied_sources(folder):
    """Return a copy of what the package is built from."""
    source = folder / 'source'
    source.mkdir()
    for name in ('LICENSE', 'README.md', 'package.xml', 'setup.py', 'setup.cfg',
                 'pyproject.toml'):
        shutil.copy(REPOSITORY / name, source)
    for name in ('tf_tree_py', 'resource', 'config', 'launch', 'rviz'):
        shutil.copytree(REPOSITORY / name, source / name, ignore=NOT_SOURCES)
    return source


@pytest.fixture(scope='module')
def wheel(tmp_path_factory):
    """
    Return the pure wheel that pip builds from a copy of the sources with leftovers of a build.

    The copy declares the address of the repository.
    """
    pytest.importorskip('pip')
    source = copied_sources(tmp_path_factory.mktemp('wheel'))
    manifest = (REPOSITORY / 'package.xml').read_text()
    (source / 'package.xml').write_text(manifest.replace(
        '  <author>', f'  <url type="repository">{ADDRESS}</url>\n  <author>', 1))
    left = source / 'build' / 'lib' / 'tf_tree_py' / 'core' / 'deleted.py'
    left.parent.mkdir(parents=True)
    left.touch()
    done = completed(sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps',
                     '--no-build-isolation', '--disable-pip-version-check', '--wheel-dir',
                     source.parent, source, env={**os.environ, 'TF_TREE_PY_PURE': '1'})
    assert done.returncode == 0, done.stderr
    [wheel] = source.parent.glob('*.whl')
    return zipfile.ZipFile(wheel)


def test_wheel_has_what_is_in_the_package_and_nothing_else(wheel):
    there = {path.relative_to(REPOSITORY).as_posix()
             for path in REPOSITORY.glob('tf_tree_py/**/*')
             if path.is_file() and path.suffix != '.c'
             and not NOT_SOURCES(path.parent, path.parts)}
    names = {name for name in wheel.namelist() if '.dist-info/' not in name}
    assert {name for name in names if name.startswith('tf_tree_py/')} == there
    share = f'tf_tree_py-{PACKAGE.version}.data/data/share/'
    assert {name for name in names if not name.startswith(share)} == there


def test_archive_of_the_sources_has_the_formulas_in_c(tmp_path):
    source = copied_sources(tmp_path)
    shutil.copy(REPOSITORY / 'MANIFEST.in', source)
    done = completed(sys.executable, 'setup.py', 'sdist', '--dist-dir', tmp_path, cwd=source,
                     env={**os.environ, 'TF_TREE_PY_PURE': '1'})  # as scripts/package makes it
    assert done.returncode == 0, done.stderr
    with tarfile.open(tmp_path / f'tf_tree_py-{PACKAGE.version}.tar.gz') as archive:
        names = {name.partition('/')[2] for name in archive.getnames()}
    assert {'tf_tree_py/core/tree/path_in_c.c', 'setup.py', 'package.xml'} <= names


def test_wheel_has_the_licence(wheel):
    assert [name for name in wheel.namelist() if name.endswith('.dist-info/licenses/LICENSE')]


def test_readme_links_to_the_repository_from_elsewhere(wheel):
    description = wheel.read(f'tf_tree_py-{PACKAGE.version}.dist-info/METADATA').decode()
    assert f'Project-URL: Repository, {ADDRESS}\n' in description
    links = LINK.findall(description)
    assert len(links) > 20
    for picture, address in links:
        begin = f'{ADDRESS}/{"raw" if picture else "blob"}/HEAD/'
        assert address.startswith(begin), address
        assert (REPOSITORY / address.removeprefix(begin)).exists(), address


def test_readme_has_no_link_that_leads_nowhere():
    """Without the address of a repository, the readme has no relative link."""
    assert all(address.startswith('https://')
               for _, address in LINK.findall(metadata('tf_tree_py')['Description']))


def test_addresses_stand_in_package_xml_alone():
    """The owner's addresses are in one file only, so no other file can contain a stale one."""
    mails = re.compile(r'[\w.+-]+@[\w-]+\.[\w.]+')
    pages = [*REPOSITORY.glob('*.md'), *REPOSITORY.glob('docs/**/*.md')]
    repeated = [page for page in pages if mails.search(page.read_text())]
    assert not repeated
    for page in ('README.md', 'CONTRIBUTING.md', 'SECURITY.md'):
        assert '(package.xml)' in (REPOSITORY / page).read_text(), page


def test_pages_say_that_it_is_not_published_as_long_as_that_is_so():
    addresses = MANIFEST.findall('url[@type="repository"]')
    for page in ('README.md', 'CONTRIBUTING.md', 'SECURITY.md'):
        said = 'not published yet' in (REPOSITORY / page).read_text()
        assert said != bool(addresses), page


def test_oldest_numerics_that_are_allowed_are_tried():
    oldest = set(re.findall(r'(\w+)==(\d+\.\d+)', (REQUIREMENTS / 'oldest.txt').read_text()))
    assert requirements() == {f'{name}>={version}' for name, version in oldest}


@pytest.mark.parametrize(('distro', 'file'), [('jazzy', 'ros.in'), ('kilted', 'kilted.in')])
def test_ros_of_an_extra_is_the_one_that_is_tested(distro, file):
    locked = set(re.findall(f'(?m)^ros-{distro}.*$', (REQUIREMENTS / file).read_text()))
    assert f'ros-{distro}-rclpy' in locked
    assert {name for name in requirements(distro) if name.startswith('ros-')} == locked


def test_extras_that_are_advised_are_there():
    known = set(metadata('tf_tree_py').get_all('Provides-Extra'))
    pages = [*REPOSITORY.glob('tf_tree_py/**/*.py'), *REPOSITORY.glob('docs/**/*.md'),
             REPOSITORY / 'README.md']
    advised = {extra for page in pages for extras in re.findall(
        r"""(?:tf_tree_py|install "?'?\.)\[([a-z0-9_,]+)\]""", page.read_text())
        for extra in extras.split(',')}
    assert {'bag', 'jazzy', 'plot'} <= advised <= known


# --- colcon

@pytest.mark.parametrize('options', [[], ['--symlink-install']], ids=['copies', 'links'])
def test_colcon_builds_without_a_warning_what_ros2_runs(options, tmp_path):
    """Only links show an edit of the sources without another build."""
    # Without bytecode, setuptools warns of that.
    env = {**standin_env(), 'PYTHONDONTWRITEBYTECODE': '', 'COLCON_HOME': str(tmp_path)}
    if shutil.which('colcon', path=env['PATH']) is None:
        pytest.skip('needs colcon: sudo apt install python3-colcon-common-extensions')
    source = copied_sources(tmp_path)

    def output_of(command):
        done = completed('bash', '-c', command, cwd=tmp_path, env=env)
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    built = output_of(f'colcon --log-base /dev/null build --paths source {" ".join(options)}')
    assert '1 package finished' in built
    assert 'stderr' not in built, built
    file = source / 'tf_tree_py' / 'command' / 'arguments.py'
    file.write_text(file.read_text().replace('compiled formulas', 'edited').replace(
        'pure Python', 'edited'))
    output = output_of('. install/local_setup.bash && ros2 run tf_tree_py tf_echo --version')
    version, _, how = output.partition(' (')
    assert version == f'tf_tree_py {PACKAGE.version}'
    assert how in (['edited)\n'] if options else ['compiled formulas)\n', 'pure Python)\n'])


# --- dependencies that rosdep installs

# Import names of Python packages whose rosdep key differs.
_KEYS = {name: f'python3-{name}' for name in ('matplotlib', 'numpy', 'rich', 'scipy', 'yaml')}

# Only some users need these, and rosdep has no key for them on Ubuntu 24.04. An extra of pip
# installs them, and the error of a missing one names the extra. Some have a fallback.
_OPTIONAL = {
    'PIL', 'apsw', 'distributed', 'jinja2', 'lz4', 'mcap', 'pandas', 'pyarrow', 'rosbags',
    'ruamel', 'trimesh', 'viser', 'websockets', 'xacro', 'zenoh', 'backports', 'compression',
    'ros2cli', 'tf2_ros'}

# Only the wheels of ROS 2 need these, to build tf2_msgs; an extra installs both.
_GENERATORS = {
    'rosidl_adapter', 'rosidl_generator_c', 'rosidl_generator_py',
    'rosidl_generator_type_description', 'rosidl_typesupport_c', 'rosidl_typesupport_fastrtps_c',
    'rosidl_typesupport_introspection_c'}


def imported(path):
    """Yield the packages that a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.partition('.')[0]


def test_manifest_has_a_key_for_whatever_is_imported():
    needed = {name for folder in ('tf_tree_py', 'launch')
              for path in (REPOSITORY / folder).rglob('*.py') if 'packages' not in path.parts
              for name in imported(path)}
    needed -= sys.stdlib_module_names | _OPTIONAL | _GENERATORS | {'tf_tree_py'}
    there = {key.text for key in MANIFEST.findall('exec_depend')}
    assert {_KEYS.get(name, name) for name in needed} == there
