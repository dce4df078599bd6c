# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The controls of a page.

Time, frames, the chosen frame, sensors, findings, and the look. They show data, and report what a
person does with them; ``page`` reacts to that.
"""
