# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All pages of the documentation, and the blocks of code in them."""

from code_blocks import blocks_of, REPOSITORY

PAGES = [REPOSITORY / 'README.md', REPOSITORY / 'CONTRIBUTING.md',
         *sorted((REPOSITORY / 'docs').rglob('*.md'))]

LANGUAGES = {'python', 'bash', 'text', 'diff'}
"""What runs, and what is only shown: formulas, output, changes."""

BLOCKS = [block for page in PAGES for block in blocks_of(page)]
