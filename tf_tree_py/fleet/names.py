# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Robots' names as people read them: no two robots should look like one.

A name with an invisible character or with surrounding white space is refused. Two names that look
alike are reported, because both may be honest. This file does not depend on Zenoh.
"""

from collections import Counter
from collections.abc import Sequence
import re
from typing import NamedTuple
import unicodedata

from tf_tree_py.core.text import shorten

# Invisible, although they are letters, marks or symbols: what is Default_Ignorable_Code_Point in
# Unicode's DerivedCoreProperties.txt and printable for Python, and the blank pattern of Braille.
_INVISIBLE = re.compile('[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180d\u180f\u2800\u3164'
                        '\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]')
# What looks like a character of ASCII in most fonts, from the confusable characters of Unicode
# Technical Standard 39: Greek (03xx), Cyrillic (04xx, 051x), Armenian (05xx), Latin beyond ASCII.
# Compatibility forms, such as full width, need no entry.
_ALIKE = {
    'a': '\u0251\u03b1\u0430', 'b': '\u044c', 'c': '\u0441', 'd': '\u0501', 'e': '\u0435',
    'g': '\u0261\u0581', 'h': '\u04bb\u0570', 'i': '\u0131\u0269\u03b9\u0456',
    'j': '\u03f3\u0458\u0575', 'k': '\u03ba\u043a', 'l': '1I|\u0399\u0406\u04c0\u04cf',
    'n': '\u03b7\u0578', 'o': '\u03bf\u03c3\u043e\u0585', 'p': '\u03c1\u0440',
    'q': '\u051b\u0566', 'r': '\u0433', 's': '\u0455', 'u': '\u03c5\u057d', 'v': '\u03bd\u0475',
    'w': '\u03c9\u051d', 'x': '\u03c7\u0445', 'y': '\u03b3\u0443', 'A': '\u0391\u0410',
    'B': '\u0392\u0412', 'C': '\u0421', 'E': '\u0395\u0415', 'H': '\u0397\u041d',
    'J': '\u0408', 'K': '\u039a\u041a', 'M': '\u039c\u041c', 'N': '\u039d',
    'O': '0\u039f\u041e', 'P': '\u03a1\u0420', 'S': '\u0405', 'T': '\u03a4\u0422',
    'X': '\u03a7\u0425', 'Y': '\u03a5\u0423', 'Z': '\u0396',
    '-': '\u2010\u2012\u2013\u2014\u2212', '/': '\u2044\u2215\u2571\u29f8'}
_LOOK = {ord(other): char for char, others in _ALIKE.items() for other in others}


def deception_in(name: str) -> str:
    """Return why a name can look the same as another one, and is refused; '': it cannot."""
    if any(part != part.strip() for part in name.split('/')):
        return 'there is white space at the beginning or the end of it, or of a part of it'
    # What Python does not print: controls, formats such as zero-width and bidirectional
    # characters, spaces beyond that of ASCII, and code points without a character.
    hidden = next((char for char in name if not char.isprintable() or _INVISIBLE.match(char)), '')
    return hidden and (f'it contains U+{ord(hidden):04X} {unicodedata.name(hidden, "(unnamed)")}, '
                       'which cannot be seen')


def look_of(name: str) -> str:
    """Return a text that is the same for names that look alike."""
    return re.sub(' +', ' ', unicodedata.normalize('NFKD', name).translate(_LOOK))


# --- the names of a fleet

# A client that may write any key can invent robots. No more than these are kept.
MOST_NAMES = 10_000


class Report(NamedTuple):
    """
    What the log should say about a name.

    :ivar sender: the name, or the beginning of too many names.
    """

    kind: str
    sender: str
    text: str


class Names:
    """
    The names of a fleet's robots, and what a person should know about them.

    Not thread-safe.

    :ivar refused: how often a name was refused.
    """

    def __init__(self, apart: bool, most_below: int) -> None:
        """
        Begin without robots.

        :param apart: no robot may have a name that is the beginning of another's.
        :param most_below: the most names that begin with the same first part and a slash. Below a
            longer beginning, such as ``site/robot7/``, there may be a tenth of that, so that a
            robot of a site does not use up the names of its site.
        """
        self.refused = 0
        self._apart = apart
        self._most_below = most_below
        self._names: set[str] = set()
        # How many names there are below each beginning, up to a slash; a name of each look.
        self._below: Counter[str] = Counter()
        self._of_look: dict[str, str] = {}

    def admit(self, name: str) -> tuple[bool, Report | None]:
        """Record a new name, or refuse it; return whether it is admitted, and what to report."""
        above = _beginnings(name)
        refusal = self._refusal(name, above)
        if refusal is not None:
            self.refused += 1
            return False, refusal
        self._names.add(name)
        self._below.update(above)
        other = self._of_look.setdefault(look_of(name), name)
        return True, None if other == name else Report('names that look alike', name, (
            f'the names of the robots {_shown(other)} and {_shown(name)} look alike: make sure '
            'that they are the robots that you expect, and give one of them another name'))

    def _refusal(self, name: str, above: Sequence[str]) -> Report | None:
        full = next((one for one in above if self._below[one] >= self._most_of(one)), None)
        if full is not None:
            return Report('too many names', full, (
                f'robots below {_shown(full)} are ignored beyond the first {self._most_of(full)}: '
                'one robot may have invented them. If they are all real, raise RobotQuota.names, '
                'or select them with key_prefix'))
        why = self._fault(name, above)
        return Report('ignored robots', name, (
            f'the robot {_shown(name)} is ignored: {why}')) if why else None

    def _fault(self, name: str, above: Sequence[str]) -> str:
        if len(self._names) >= MOST_NAMES:
            return f'there are {MOST_NAMES} robots already'
        if self._apart and (name in self._below or any(one in self._names for one in above)):
            return 'its frames would mix with those of another robot'
        return deception_in(name)

    def _most_of(self, beginning: str) -> int:
        return max(1, self._most_below // 10) if '/' in beginning else self._most_below


def _beginnings(name: str) -> list[str]:
    """Return the beginnings of a name, up to each of its slashes."""
    parts = name.split('/')
    return ['/'.join(parts[:count]) for count in range(1, len(parts))]


def _shown(name: str) -> str:
    return ascii(shorten(name, 80))
