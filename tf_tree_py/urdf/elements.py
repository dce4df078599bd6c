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

"""
XML as elements that know their lines.

Nothing is fetched or expanded on behalf of the text: a DOCTYPE, the only place where XML
can name other files or define entities, is refused.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

from tf_tree_py.core.text import shorten

# What a joint, a link or a material is, its own parts say too when something is wrong in them.
_OWNERS = ('joint', 'link', 'material')
_LONGEST_VALUE = 80
# How many names an error lists.
_LISTED = 6


class DescriptionError(ValueError):
    """
    A robot description that cannot be used.

    :ivar source: where it comes from, such as its file.
    :ivar line: the number of the line in it; 0: it is not about one line.
    :ivar owner: what is wrong, such as ``joint 'elbow'``; may be empty.
    :ivar problem: what is wrong with it.
    :ivar mend: what to do about it.
    """

    def __init__(self, source: str, line: int, owner: str, problem: str, mend: str) -> None:
        self.source, self.line, self.owner = source, line, owner
        self.problem, self.mend = problem, mend
        place = f'{source}, line {line}' if line else source
        super().__init__(shorten(': '.join(filter(None, (place, owner, f'{problem}; {mend}')))))

    def __reduce__(self) -> tuple[type, tuple[str, int, str, str, str]]:
        return type(self), (self.source, self.line, self.owner, self.problem, self.mend)


@dataclass(frozen=True)
class Element:
    """
    One element, and where it stands.

    :ivar source: what the text is called in errors.
    :ivar owner: the joint or link that it belongs to, for errors.
    """

    tag: str
    attributes: dict[str, str]
    source: str
    line: int
    owner: str
    children: list['Element'] = field(default_factory=list)

    def error(self, problem: str, mend: str) -> DescriptionError:
        """Return an error that names this element's place."""
        return DescriptionError(self.source, self.line, self.owner, problem, mend)

    def children_of(self, tag: str) -> list['Element']:
        """Return the children of a kind."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> 'Element | None':
        """Return the first child of a kind; None without one."""
        return next((child for child in self.children if child.tag == tag), None)

    def attribute(self, name: str, mend: str) -> str:
        """
        Return the text of an attribute.

        :raises DescriptionError: it is not there, or empty.
        """
        text = self.attributes.get(name, '').strip()
        if not text:
            raise self.error(f'<{self.tag}> has no {name}', mend)
        return text


def quoted(text: str) -> str:
    """Return a text of the description for an error, cut short."""
    return repr(shorten(text, _LONGEST_VALUE))


def listed(texts: Iterable[str]) -> str:
    """Return names for an error, or the first of them."""
    names = list(texts)
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    return ', '.join(names[:_LISTED]) + more


def read(text: str | bytes, source: str) -> Element:
    """
    Return the outermost element of a text.

    :raises DescriptionError: it is no XML, has a DOCTYPE, or has macros in it.
    """
    return _Reader(source).read(text)


class _Reader:
    """Builds elements of what expat finds."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._open: list[Element] = []
        self._root: Element | None = None
        # Whatever the text says of its encoding: it is UTF-8 by now.
        self._parser = expat.ParserCreate('utf-8')
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse_doctype

    def read(self, text: str | bytes) -> Element:
        if isinstance(text, str):
            text = text.encode('utf-8', 'surrogatepass')
        try:
            self._parser.Parse(text, True)
        except expat.ExpatError as error:
            raise self._not_xml(error) from None
        assert self._root is not None
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        owner = self._open[-1].owner if self._open else ''
        if len(self._open) == 1 and tag in _OWNERS:
            owner = f'{tag} {quoted(attributes.get("name", ""))}'
        element = Element(tag, attributes, self._source, self._parser.CurrentLineNumber, owner)
        if tag.startswith('xacro:'):
            raise element.error(f'<{tag}> is a macro of xacro', 'expand it first (xacro FILE), or '
                                'name the file so that it ends in .xacro')
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _refuse_doctype(self, *_: object) -> NoReturn:
        raise DescriptionError(
            self._source, self._parser.CurrentLineNumber, '',
            'there is a DOCTYPE, which can name other files and define entities',
            'take it out: a robot description needs none')

    def _not_xml(self, error: expat.ExpatError) -> DescriptionError:
        problem = f'this is no XML: {expat.ErrorString(error.code)}'
        mend = 'write <robot name="..."> ... </robot>'
        if self._open:
            last = self._open[-1]
            mend = f'<{last.tag}> of line {last.line} is the last that was opened and not closed'
        return DescriptionError(self._source, error.lineno, '', problem, mend)
