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

"""Whether links and joints form one tree: each link on one other, all on one root, no loop."""

from collections.abc import Mapping, Sequence

from tf_tree_py.core.suggest import nearest

from .elements import Element, listed, quoted
from .joints import Joint


def root_of(robot: Element, links: Mapping[str, Element],
            joints: Sequence[tuple[Joint, Element]]) -> str:
    """
    Return the link on which all others hang.

    :param links: by name.
    :raises DescriptionError: there is none, or more than one; or the links form no tree.
    """
    if not links:
        raise robot.error('it has no links', 'write at least one <link name="..."/>')
    above: dict[str, Joint] = {}
    for joint, element in joints:
        for end, link in (('parent', joint.parent), ('child', joint.child)):
            _check_that_it_is_there(element.first(end) or element, end, link, links)
        if joint.child in above:
            raise element.error(
                f'its child {quoted(joint.child)} has a parent already, by the joint '
                f'{quoted(above[joint.child].name)}',
                'a link hangs on one other: take one of the two joints out')
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    elements = {joint.name: element for joint, element in joints}
    if len(roots) > 1:
        raise _two_roots(robot, roots, links)
    _check_that_none_is_in_a_loop(links, above, elements)
    return roots[0]


def _check_that_it_is_there(element: Element, end: str, link: str,
                            links: Mapping[str, Element]) -> None:
    if link in links:
        return
    meant = nearest(link, links)
    raise element.error(f'its {end} {quoted(link)} is no link of this description',
                        (f'did you mean {quoted(meant)}? Else ' if meant else '')
                        + f'add <link name={_attribute(link)}/>')


def _two_roots(robot: Element, roots: Sequence[str], links: Mapping[str, Element]) -> Exception:
    told = listed(f'{quoted(root)} (line {links[root].line})' for root in roots)
    return robot.error(
        f'{len(roots)} links have no parent: {told}',
        'a tree has one root: hang the others on it, each as the child of a joint, such as one '
        'of type="fixed"')


def _check_that_none_is_in_a_loop(links: Mapping[str, Element], above: Mapping[str, Joint],
                                  elements: Mapping[str, Element]) -> None:
    """Climb from every link; whoever meets itself is in a loop. Each link is climbed from once."""
    done: set[str] = set()
    for link in links:
        climbed: dict[str, Joint] = {}
        while link in above and link not in done and link not in climbed:
            climbed[link] = above[link]
            link = above[link].parent
        if link in climbed:
            names = [joint.name for joint in climbed.values()][list(climbed).index(link):]
            loop = sorted(map(elements.__getitem__, names), key=lambda element: element.line)
            told = listed(f'{quoted(joint.attributes["name"])} (line {joint.line})'
                          for joint in loop)
            raise loop[0].error(
                f'it is part of a loop, so that no link is the uppermost: {told}',
                'turn a joint round or take it out')
        done.update(climbed)


def _attribute(text: str) -> str:
    return quoted(text).replace("'", '"')
