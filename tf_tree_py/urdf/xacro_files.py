# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Reads the text of a robot description from a file, and expands it with xacro if necessary."""

from collections.abc import Iterable, Mapping
from pathlib import Path
import re
from typing import NamedTuple
from xml.dom import expatbuilder
from xml.dom.minidom import Document, Element
from xml.parsers import expat

from .robot_xml import DescriptionError, Place

INSTALL = 'pip install xacro, or apt install ros-jazzy-xacro'
# During the expansion, each element that is not a macro has its file and line in this attribute.
_PLACE = 'tf_tree_py_place'


class DescriptionText(NamedTuple):
    """
    A description as XML.

    :ivar files: the file itself and the files that it includes.
    :ivar places: the file and line of each element, in the order of their start tags; None: the
        lines of the text.
    """

    text: str
    files: tuple[Path, ...]
    places: tuple[Place, ...] | None = None


def description_of(path: str | Path, arguments: Mapping[str, str] | None = None
                   ) -> DescriptionText:
    """
    Return the description in a file.

    :param path: of a URDF, or of a file that ends in .xacro.
    :param arguments: of the xacro, such as ``{'prefix': 'left_'}``.
    :raises OSError: the file cannot be read.
    :raises DescriptionError: the file is not UTF-8, or xacro is missing or refuses it.
    """
    path = Path(path)
    data = path.read_bytes()
    if path.suffix == '.xacro':
        return _expanded(path, dict(arguments or {}))
    if arguments:
        raise DescriptionError(
            str(path), 0, '', f'it takes no arguments such as {next(iter(arguments))}',
            'only a file that ends in .xacro has arguments')
    try:
        return DescriptionText(data.decode('utf-8-sig'), (path,))
    except UnicodeDecodeError as error:
        line = data.count(b'\n', 0, error.start) + 1
        raise DescriptionError(str(path), line, '', 'this is not UTF-8',
                               'save the file in that encoding') from None


def _expanded(path: Path, arguments: dict[str, str]) -> DescriptionText:
    try:
        import xacro
    except ModuleNotFoundError:
        raise DescriptionError(str(path), 0, '', 'the package xacro is not installed',
                               INSTALL) from None
    xacro.all_includes.clear()
    parse, xacro.parse = xacro.parse, _parse_with_places
    try:
        document = xacro.process_file(str(path), mappings=arguments)
    except DescriptionError:
        raise
    except Exception as error:  # noqa: B902 - xacro evaluates Python code in the file
        raise _refused(path, error) from error
    finally:
        xacro.parse = parse
    places = tuple(_pop_places(document.documentElement, Place(str(path), 1)))
    files = dict.fromkeys([path, *map(Path, xacro.all_includes)])
    return DescriptionText(str(document.toprettyxml(indent='  ')), tuple(files), places)


def _parse_with_places(text: bytes | str | None, filename: str | None = None) -> Document:
    """Parse as ``xacro.parse`` does, and add its file and line to each element."""
    text_name = filename or 'the robot description'
    data = Path(text_name).read_bytes() if text is None else text
    try:
        return _Builder(text_name).parseString(data)
    except expat.ExpatError as error:
        raise DescriptionError(
            text_name, error.lineno, '', f'this is not valid XML: {expat.ErrorString(error.code)}',
            'check this line and the lines before it') from None


class _Builder(expatbuilder.ExpatBuilderNS):
    """Builds a document whose elements have their file and line in an attribute."""

    def __init__(self, text_name: str) -> None:
        super().__init__()
        self._text_name = text_name

    def start_element_handler(self, name: str, attributes: list[str]) -> None:
        super().start_element_handler(name, attributes)
        element = self.curNode
        assert isinstance(element, Element)
        if not element.tagName.startswith('xacro:'):
            element.setAttribute(_PLACE, f'{self.getParser().CurrentLineNumber} '
                                 + self._text_name)


def _pop_places(element: Element, around: Place) -> 'list[Place]':
    """Remove the places from a document, and return them in the order of the elements."""
    found = []
    waiting = [(element, around)]
    while waiting:
        node, outer = waiting.pop()
        line, _, text_name = node.getAttribute(_PLACE).partition(' ')
        place = Place(text_name, int(line)) if line else outer
        if node.hasAttribute(_PLACE):
            node.removeAttribute(_PLACE)
        found.append(place)
        waiting += [(child, place) for child in reversed(node.childNodes)
                    if child.nodeType == child.ELEMENT_NODE]
    return found


def _refused(path: Path, error: Exception) -> DescriptionError:
    """Return an error with the innermost file and line that contain what xacro's error names."""
    import xacro
    stacks = [*[macro.history[-1] for macro in xacro.macrostack or []], xacro.filestack or []]
    files = dict.fromkeys(Path(file) for stack in reversed(stacks)
                          for file in reversed(stack) if file and Path(file).is_file())
    place = _place_of(str(error), [*files, path]) or Place(str(next(iter(files), path)), 0)
    return DescriptionError(*place, '', f'xacro: {error}',
                            'run xacro FILE on the command line for details')


def _place_of(problem: str, files: Iterable[Path]) -> Place | None:
    """Return the first line that contains a quotation of an error, the longest one first."""
    quoted = [max(pair) for pair in re.findall(r"'([^']+)'|\"([^\"]+)\"", problem)]
    words = [form for word in sorted(quoted, key=len, reverse=True)
             for form in (word, Path(word).name) if form]
    lines = {file: file.read_text(encoding='utf-8', errors='replace').splitlines()
             for file in files}
    for word in [*words, *re.findall(r'[\w:]{3,}', problem)[-1:]]:
        whole = re.compile(rf'(?<!\w){re.escape(word)}(?!\w)')
        for file, content in lines.items():
            for number, line in enumerate(content, start=1):
                if whole.search(line):
                    return Place(str(file), number)
    return None
