# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The text of a robot description in a file; what is written for xacro is expanded by it."""

from pathlib import Path

from .elements import DescriptionError

INSTALL = 'pip install "tf_tree_py[xacro]", or apt install ros-jazzy-xacro'


def text_of(path: str | Path) -> str:
    """
    Return a description as XML.

    :param path: a file of URDF, or one that ends in .xacro.
    :raises OSError: it cannot be read.
    :raises DescriptionError: it is no UTF-8, or xacro is missing or refuses it.
    """
    path = Path(path)
    data = path.read_bytes()
    if path.suffix == '.xacro':
        return _expanded(path)
    try:
        return data.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        line = data.count(b'\n', 0, error.start) + 1
        raise DescriptionError(str(path), line, '', 'this is no UTF-8',
                               'save the file in that encoding') from None


def _expanded(path: Path) -> str:
    try:
        import xacro
    except ModuleNotFoundError:
        raise DescriptionError(str(path), 0, '', 'the package xacro is not installed',
                               INSTALL) from None
    try:
        return str(xacro.process_file(str(path)).toprettyxml(indent='  '))
    except Exception as error:  # noqa: B902 - it evaluates Python that is written in the file
        raise DescriptionError(str(path), 0, '', f'xacro: {error}',
                               'xacro FILE on the command line tells more') from error
