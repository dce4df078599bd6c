# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads XML as elements with their line numbers; and numbers, vectors and poses in it.

A DOCTYPE is refused, because it can refer to other files and define entities. Nothing is
therefore fetched or expanded.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
import math
import re
from typing import NamedTuple, NoReturn
from xml.parsers import expat

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.text import shorten

# An error in a part of one of these elements also names the element.
_OWNERS = ('joint', 'link', 'material')
_LONGEST_VALUE = 80
# The greatest number of names in an error.
_LISTED = 6


class DescriptionError(ValueError):
    """
    A robot description that cannot be used.

    :ivar text_name: the name of the description, such as its file.
    :ivar line: the number of the line; 0: the error concerns no single line.
    :ivar owner: the element with the error, such as ``joint 'elbow'``; may be empty.
    :ivar problem: the error.
    :ivar fix: what to do about it.
    """

    def __init__(self, text_name: str, line: int, owner: str, problem: str, fix: str) -> None:
        self.text_name, self.line, self.owner = text_name, line, owner
        self.problem, self.fix = problem, fix
        place = f'{text_name}, line {line}' if line else text_name
        super().__init__(shorten(': '.join(filter(None, (place, owner, f'{problem}; {fix}')))))

    def __reduce__(self) -> tuple[type, tuple[str, int, str, str, str]]:
        return type(self), (self.text_name, self.line, self.owner, self.problem, self.fix)


class Place(NamedTuple):
    """The location of an element: its file or text, and its line."""

    text_name: str
    line: int


@dataclass(frozen=True)
class Element:
    """
    One element and its location.

    :ivar text_name: the name of the text in errors.
    :ivar owner: the joint, link or material that contains the element, for errors.
    """

    tag: str
    attributes: dict[str, str]
    text_name: str
    line: int
    owner: str
    children: list['Element'] = field(default_factory=list)

    def error(self, problem: str, fix: str) -> DescriptionError:
        """Return an error that names the location of this element."""
        return DescriptionError(self.text_name, self.line, self.owner, problem, fix)

    def children_of(self, tag: str) -> list['Element']:
        """Return the children with a tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> 'Element | None':
        """Return the first child with a tag; None if there is none."""
        return next((child for child in self.children if child.tag == tag), None)

    def attribute(self, name: str, fix: str) -> str:
        """
        Return the text of an attribute.

        :param fix: what the error recommends.
        :raises DescriptionError: the attribute is missing or empty.
        """
        text = self.attributes.get(name, '').strip()
        if not text:
            raise self.error(f'<{self.tag}> has no {name}', fix)
        return text


def quoted(text: str) -> str:
    """Return a text of the description for an error, shortened and in quotes."""
    return repr(shorten(text, _LONGEST_VALUE))


def listed(texts: Iterable[str]) -> str:
    """Return a list of names for an error, shortened if it is long."""
    names = list(texts)
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    return ', '.join(names[:_LISTED]) + more


def read(text: str | bytes, text_name: str, places: Sequence[Place] | None = None) -> Element:
    """
    Return the outermost element of a text.

    :param places: the file and line of each element, in the order of their start tags, if the
        text was made from other files; None: the lines of the text.
    :raises DescriptionError: the text is not valid XML, or it has a DOCTYPE or macros.
    """
    return _Reader(text_name, places).read(text)


def without_space_before(text: str | bytes, text_name: str, warnings: list[str]) -> bytes:
    """
    Return a text as UTF-8, without its XML declaration if that follows white space.

    XML forbids this white space, but launch files often produce it, so it is only a warning.
    The line numbers do not change.
    """
    data = text.encode('utf-8', 'surrogatepass') if isinstance(text, str) else text
    match = re.match(rb'\s+(<\?xml\s[^>]*\?>)', data)
    if match is None:
        return data
    line = data.count(b'\n', 0, match.start(1)) + 1
    warnings.append(str(DescriptionError(
        text_name, line, '', 'there is white space before <?xml',
        'remove it, because other programs may refuse the description')))
    return data[:match.start(1)] + b'\n' * match[1].count(b'\n') + data[match.end(1):]


class _Reader:
    """Builds elements from the events of expat."""

    def __init__(self, text_name: str, places: Sequence[Place] | None) -> None:
        self._text_name = text_name
        self._places = None if places is None else iter(places)
        self._open: list[Element] = []
        self._root: Element | None = None
        # The text is UTF-8 by now, whatever encoding it declares.
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
        place = Place(self._text_name, self._parser.CurrentLineNumber)
        if self._places is not None:
            place = next(self._places, place)
        element = Element(tag, attributes, *place, owner)
        if tag.startswith('xacro:'):
            raise element.error(f'<{tag}> is a macro of xacro', 'expand it first (xacro FILE), or '
                                'let the name of the file end in .xacro')
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _refuse_doctype(self, *_: object) -> NoReturn:
        raise DescriptionError(
            self._text_name, self._parser.CurrentLineNumber, '',
            'there is a DOCTYPE, which can refer to other files and define entities',
            'remove it: a robot description does not need it')

    def _not_xml(self, error: expat.ExpatError) -> DescriptionError:
        problem = f'this is not valid XML: {expat.ErrorString(error.code)}'
        fix = 'write <robot name="..."> ... </robot>'
        if self._open:
            last = self._open[-1]
            fix = f'<{last.tag}> in line {last.line} is not closed'
        return DescriptionError(self._text_name, error.lineno, '', problem, fix)


# --- numbers and poses

def number(element: Element, name: str, default: float) -> float:
    """Return the number in an attribute, or a default without the attribute; see ``numbers``."""
    return numbers(element, name, (default,))[0]


def positive(element: Element, name: str, count: int = 1) -> tuple[float, ...]:
    """
    Return the sizes in an attribute.

    :raises DescriptionError: the attribute is missing, or a size is not greater than zero.
    """
    element.attribute(name, f'write {_numbers(count)}, metres')
    found = numbers(element, name, (math.nan,) * count)
    if min(found) <= 0.0:
        raise element.error(f'<{element.tag}> has the {name} {quoted(element.attributes[name])}',
                            'write a size greater than zero')
    return found


def numbers(element: Element, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """
    Return the numbers in an attribute.

    :param default: the result without the attribute. Its length is the expected count.
    :raises DescriptionError: the count is wrong, or a word is not a number.
    """
    text = element.attributes.get(name)
    if text is None:
        return default
    words = text.split()
    what = f'<{element.tag}> has the {name} {quoted(text)}'
    if len(words) != len(default):
        raise element.error(what, f'write {_numbers(len(default))}, with spaces between them')
    found = tuple(map(_finite, words))
    for word, value in zip(words, found, strict=True):
        if value is None:
            hint = ', expand it with xacro first' if '$' in word else ''
            raise element.error(f'{what}, and {quoted(word)} is not a number',
                                f'write a finite number, such as 0.25{hint}')
    return tuple(value for value in found if value is not None)


def _finite(word: str) -> float | None:
    """Return a finite number; None if the word is not one. Unlike in Python, 1_0 is not one."""
    try:
        value = math.nan if '_' in word else float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _numbers(count: int) -> str:
    return 'one number' if count == 1 else f'{count} numbers'


def origin_of(element: Element, warnings: list[str]) -> Pose:
    """
    Return the pose of the <origin> in an element: metres, and radians about fixed axes.

    :param warnings: a sentence is added for a quaternion, which is ignored.
    :raises DescriptionError: a word in it is not a number.
    """
    origin = element.first('origin')
    if origin is None:
        return Pose()
    if 'quat_xyzw' in origin.attributes:
        warnings.append(str(_ignored_quaternion(origin)))
    return Pose.from_xyz_rpy(*numbers(origin, 'xyz', (0.0, 0.0, 0.0)),
                             *numbers(origin, 'rpy', (0.0, 0.0, 0.0)))


# The parsers of Jazzy (urdfdom 4.0) and Kilted (5.0) read the attributes xyz and rpy of an
# <origin>, and no others. quat_xyzw belongs to URDF 1.1. Later parsers read it in a description
# of that version, ignore it in one of version 1.0, and refuse rpy beside it. Those of Jazzy and
# Kilted refuse every version but 1.0.
def _ignored_quaternion(origin: Element) -> DescriptionError:
    ignored = ('<origin> has a quat_xyzw, which URDF 1.0 lacks and robot_state_publisher of Jazzy '
               'ignores')
    if 'rpy' in origin.attributes:
        return origin.error(f'{ignored}, so only the rpy beside it counts', 'remove quat_xyzw')
    return origin.error(f'{ignored}, so there is no rotation', f'write {_as_rpy(origin)} instead')


def _as_rpy(origin: Element) -> str:
    """Return the attribute rpy for a quaternion; in words if that is not a rotation."""
    with suppress(ValueError):
        quaternion = numbers(origin, 'quat_xyzw', (0.0, 0.0, 0.0, 1.0))
        angles = Pose.from_parts((0.0, 0.0, 0.0), quaternion).as_rpy()
        return f'rpy="{" ".join(repr(round(angle, 9) + 0.0) for angle in angles)}"'
    return 'the rotation as rpy, radians,'
