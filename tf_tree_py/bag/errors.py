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

"""What can be wrong with a bag as a whole; what is odd inside one is told by ``oddities``."""

from pathlib import Path

from tf_tree_py.core.errors import TreeFileError


class BagError(TreeFileError):
    """
    A bag that cannot be read or written, in one sentence.

    Programs print it and end with the status 2.
    """


def needs_extra(error: ImportError) -> BagError:
    """Return what to say where a library that reads bags is not installed."""
    return BagError(f'reading and writing bags needs {error.name}, which is not installed: '
                    "pip install 'tf_tree_py[bag]'")


def no_such_file(path: Path) -> BagError:
    """Return what to say of a path where nothing is."""
    return BagError(f'{path}: there is no such file or folder')
