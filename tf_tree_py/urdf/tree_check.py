# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks that links and joints form one tree: one root, one parent for each link, no loop."""

from collections.abc import Mapping, Sequence

from tf_tree_py.core.text import nearest

from .joints import Joint
from .xml_elements import Element, listed, quoted


def root_of(robot: Element, links: Mapping[str, Element],
            joints: Sequence[tuple[Joint, Element]]) -> str:
    """
    Return the root: the link without a parent.

    :param links: by name.
    :raises DescriptionError: the links do not form one tree.
    """
    if not links:
        raise robot.error('it has no links', 'write at least one <link name="..."/>')
    above: dict[str, Joint] = {}
    for joint, element in joints:
        for end, link in (('parent', joint.parent), ('child', joint.child)):
            _check_that_it_exists(element.first(end) or element, end, link, links)
        if joint.child in above:
            raise element.error(
                f'its child {quoted(joint.child)} already has a parent, through the joint '
                f'{quoted(above[joint.child].name)}',
                'a link has one parent: remove one of the two joints')
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    elements = {joint.name: element for joint, element in joints}
    if len(roots) > 1:
        raise _two_roots(robot, roots, links)
    _check_that_none_is_in_a_loop(links, above, elements)
    return roots[0]


def _check_that_it_exists(element: Element, end: str, link: str,
                          links: Mapping[str, Element]) -> None:
    if link in links:
        return
    meant = nearest(link, links)
    raise element.error(f'its {end} {quoted(link)} is not a link of this description',
                        (f'did you mean {quoted(meant)}? Otherwise ' if meant else '')
                        + f'add <link name={_attribute(link)}/>')


def _two_roots(robot: Element, roots: Sequence[str], links: Mapping[str, Element]) -> Exception:
    found = listed(f'{quoted(root)} (line {links[root].line})' for root in roots)
    return robot.error(
        f'{len(roots)} links have no parent: {found}',
        'a tree has one root: make each of the others the child of a joint, such as one of '
        'type="fixed"')


def _check_that_none_is_in_a_loop(links: Mapping[str, Element], above: Mapping[str, Joint],
                                  elements: Mapping[str, Element]) -> None:
    """Check that the way up from each link does not lead back to it; visit each link once."""
    done: set[str] = set()
    for link in links:
        climbed: dict[str, Joint] = {}
        while link in above and link not in done and link not in climbed:
            climbed[link] = above[link]
            link = above[link].parent
        if link in climbed:
            names = [joint.name for joint in climbed.values()][list(climbed).index(link):]
            loop = sorted(map(elements.__getitem__, names), key=lambda element: element.line)
            found = listed(f'{quoted(joint.attributes["name"])} (line {joint.line})'
                           for joint in loop)
            raise loop[0].error(f'it is part of a loop, which has no root: {found}',
                                'reverse one of these joints, or remove it')
        done.update(climbed)


def _attribute(text: str) -> str:
    return quoted(text).replace("'", '"')
