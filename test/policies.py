# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The first interpolation of docs/interpolation.md, for tests."""

from code_blocks import blocks_of, program, REPOSITORY

_PAGE = REPOSITORY / 'docs' / 'interpolation.md'
_names = {'__name__': __name__}
exec(compile(program(blocks_of(_PAGE)[:1]), _PAGE, 'exec'), _names)

HoldNewest = _names['HoldNewest']
