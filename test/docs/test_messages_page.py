# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page about messages lists all types that need no registration, and no others."""

from inspect import signature
import re

from code_blocks import REPOSITORY
import pytest

pytest.importorskip('rclpy')

PAGE = (REPOSITORY / 'docs' / 'messages.md').read_text()


def columns():
    """Return the names in the first two columns of the table: with a header, and without."""
    table = PAGE.partition('## Types that need no registration\n')[2].partition('\n## ')[0]
    rows = [row.split('|')[1:3] for row in table.splitlines() if row.startswith('| `')]
    assert rows
    return [[name for cell in column for name in re.findall(r'`(\w+)`', cell)]
            for column in zip(*rows, strict=True)]


def test_table_lists_the_registry():
    from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
    named = sum(columns(), [])
    assert len(named) == len(set(named))
    assert set(named) == {cls.__name__ for cls in TRANSFORMERS}


def test_each_type_is_in_the_column_of_its_header():
    from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
    with_header = {cls.__name__ for cls in TRANSFORMERS
                   if 'header' in cls.get_fields_and_field_types()}
    assert [set(column) for column in columns()] == [
        with_header, {cls.__name__ for cls in TRANSFORMERS} - with_header]


def test_packages_of_the_types_are_those_that_the_page_names():
    from tf_tree_py.ros.messages.do_transform import TRANSFORMERS
    assert 'They are of geometry_msgs, nav_msgs and sensor_msgs.' in PAGE
    assert {cls.__module__.partition('.')[0] for cls in TRANSFORMERS} == {
        'geometry_msgs', 'nav_msgs', 'sensor_msgs'}


def test_lever_arm_belongs_to_the_functions_that_the_page_names():
    from tf_tree_py.ros.messages import do_transform
    takers = {name for name in vars(do_transform) if name.startswith('do_transform_')
              and 'lever_arm' in signature(getattr(do_transform, name)).parameters}
    sentence = re.search(r'The argument belongs to (.*?):', PAGE, re.DOTALL)[1]
    assert set(re.findall(r'`(\w+)`', sentence)) == takers
