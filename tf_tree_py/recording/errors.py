# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error of a whole bag; ``bag`` reports anomalies inside one."""

from tf_tree_py.core.errors import TreeFileError


class BagError(TreeFileError):
    """
    A bag cannot be read or written; the message is one sentence.

    Commands print it and exit with status 2.
    """


def needs_extra(error: ImportError) -> BagError:
    """
    Return the error for a missing library that reads or writes bags.

    :raises ImportError: a module of this package is missing, which is a defect of it.
    """
    if (error.name or '').partition('.')[0] in ('', 'tf_tree_py'):
        raise error
    return BagError(f'reading and writing bags needs {error.name}, which is not installed: '
                    'pip install rosbags')
