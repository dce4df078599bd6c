# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads a YAML file of static transforms, and refuses what YAML would silently change.

YAML 1.1, which PyYAML reads, has more numbers than people expect: 1:30 is 90, 010 is 8, and 1_000
is 1000. Of two equal keys, the last counts.
"""

from typing import TextIO

import yaml

from .bad_input import BadInput
from .static_words import COVARIANCE, DECIMAL, FRAMES, NUMBERS

_TAG = 'tag:yaml.org,2002:'
_TAGS = {'str': 'a string', 'null': 'nothing', 'timestamp': 'a date', 'binary': 'bytes'}


def read_yaml(file: TextIO) -> object:
    """
    Return the content of a file.

    :raises BadInput: a key is given twice, a number is not an ordinary decimal number, or a frame
        is not a string.
    :raises yaml.YAMLError: it is not YAML.
    :raises ValueError: it is not UTF-8, or YAML cannot read a value, such as a 13th month.
    """
    loader = _Loader(file)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


class _Loader(yaml.SafeLoader):
    """Checks the keys and values of each mapping, while they still have their text and line."""

    def compose_mapping_node(self, anchor: str | None) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        first: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        for key, value in node.value:
            # << merges another mapping, and may appear twice.
            if not isinstance(key, yaml.ScalarNode) or key.tag == f'{_TAG}merge':
                continue
            if key.value in first:
                raise self._given_twice(*first[key.value], key, value)
            first[key.value] = key, value
            self._check(key.value, value)
        return node

    def _check(self, word: str, value: yaml.Node) -> None:
        """Check the value of a keyword; its structure is checked with the transform."""
        if word == COVARIANCE and isinstance(value, yaml.SequenceNode):
            for each in value.value:
                self._check_number('a number of the covariance', each)
        elif word in NUMBERS:
            self._check_number(word, value)
        elif word in FRAMES:
            self._check_name(word, value)

    def _check_name(self, word: str, value: yaml.Node) -> None:
        if isinstance(value, yaml.ScalarNode) and value.value and value.tag != f'{_TAG}str':
            raise self._refused(value, word, f'enclose it in quotes: "{value.value}"')

    def _check_number(self, word: str, value: yaml.Node) -> None:
        if not isinstance(value, yaml.ScalarNode):
            return
        text, example = value.value.strip(), '0.25'
        if DECIMAL.fullmatch(text):
            # Only an octal number looks like a decimal one, but is another.
            if value.tag != f'{_TAG}int' or self.construct_object(value) == int(text):
                return
            example = str(int(text))
        fix = f'an ordinary decimal number, such as {example}'
        if DECIMAL.fullmatch(reading := self._reading(value)):
            fix = f'{reading} if that is meant, and otherwise {fix}'
        raise self._refused(value, word, f'write {fix}')

    def _refused(self, value: yaml.ScalarNode, word: str, fix: str) -> BadInput:
        return BadInput(f'{self._place(value)}: {word} is {_written(value)}, which YAML reads as '
                        f'{self._reading(value)}; {fix}')

    def _reading(self, value: yaml.ScalarNode) -> str:
        """Return in words what YAML makes of a text."""
        tag = value.tag.removeprefix(_TAG)
        return _TAGS[tag] if tag in _TAGS else str(self.construct_object(value)).lower()

    def _given_twice(self, before: yaml.Node, its_value: yaml.Node, key: yaml.ScalarNode,
                     value: yaml.Node) -> BadInput:
        fix = 'remove one of the two'
        both = [f'in line {_line(each)}' for each in (before, key)]
        if isinstance(its_value, yaml.ScalarNode) and isinstance(value, yaml.ScalarNode):
            both = [f'{where} as {_written(each)}' for where, each
                    in zip(both, (its_value, value), strict=True)]
        else:
            fix += ', or join them'
        return BadInput(f'{self._place(key)}: {key.value} is given twice, {" and ".join(both)}, '
                        f'of which YAML would use only the last; {fix}')

    def _place(self, node: yaml.Node) -> str:
        return f'{self.name}, line {_line(node)}'


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1


def _written(node: yaml.ScalarNode) -> str:
    return f'{node.value!r:.60}'
