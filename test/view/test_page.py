# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pages in a real Chromium: the drawn objects are read from the browser's own scene."""

from contextlib import contextmanager
import threading

import numpy as np
from open_page import OpenPage, overlaps
import pytest
from served_pages import hold_up, pages_of
from tf_tree_py import BufferCore, screws
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.view.robot.shapes import LinkShape

pytest.importorskip('viser', reason='pages need viser')

SECOND = 1_000_000_000
FIRST, LAST = 100 * SECOND, 110 * SECOND
SHAPES = [LinkShape(link, np.eye(3), np.array([(0, 1, 2)]), (1.0, 0.0, 0.0, 1.0))
          for link in ('camera', 'no_frame')]


def pose_at(stamp, turn):
    time_s = stamp / SECOND
    return Pose(*screws.exp(
        (np.cos(time_s), 0.3 * turn, 0.2, 0.0, 0.1 * turn, 0.3 * time_s % 1.0)))


def feed(buffer, begin, end, children=('odom', 'base_link', 'gripper')):
    parents = {'odom': 'world', 'base_link': 'odom', 'gripper': 'base_link'}
    buffer.insert_many([
        Sample(parents[child], child, stamp, pose_at(stamp, turn))
        for turn, child in enumerate(children) for stamp in range(begin, end + 1, SECOND // 20)],
        strict=False)


class Robot(BufferCore):
    """A buffer of five frames with a clock that tests set; it counts its viewers."""

    def __init__(self):
        super().__init__(UNLIMITED)
        self.looked = 0
        self.findings = []
        self.stand_anew()

    def stand_anew(self):
        self.time = LAST
        self.insert('base_link', 'camera', 0, Pose(x=0.2, z=0.5), static=True)
        feed(self, FIRST, LAST)

    def lookup_tree(self, *arguments):
        self.looked += 1
        return super().lookup_tree(*arguments)


@contextmanager
def serve(robot):
    from tf_tree_py.view.serving import Serving
    from tf_tree_py.view.subject import Subject
    subject = Subject(robot, True, lambda: robot.time, lambda: robot.findings, SHAPES)
    with Serving(subject, '127.0.0.1', 18200, 'test') as serving:
        yield serving


@pytest.fixture(scope='module')
def serving():
    """Return a server of a robot's pages; every test fills the tree again."""
    robot = Robot()
    with serve(robot) as serving:
        serving.robot = robot
        yield serving


@pytest.fixture
def robot(serving):
    robot = serving.robot
    for frame in robot.frames():
        robot.remove_frame(frame)
    robot.stand_anew()
    return robot


@pytest.fixture(scope='module')
def kept_page(window, serving):
    opened = OpenPage(window, serving.url)
    yield opened
    opened.page.close()


@pytest.fixture
def page(robot, kept_page, serving):
    """Return the page of all tests that take back their choices: opening one takes seconds."""
    kept_page.wait_for(lambda: len(pages_of(serving)) == 1)
    kept_page.press('live')
    show_frames(kept_page)
    yield kept_page
    assert not kept_page.complaints


@pytest.fixture
def new_page(robot, window, serving):
    opened = OpenPage(window, serving.url)
    show_frames(opened)
    yield opened
    opened.page.close()
    assert not opened.complaints


def show_frames(page):
    page.turn_to('frames')
    page.wait_for_text('live at 110')


def stand_as(robot, stamp, fixed_frame='world'):
    """Return a predicate: axes have the poses of the lookup, to the precision of a float32."""
    poses = np.array(list(robot.lookup_tree(fixed_frame, stamp).values()))
    rotations = np.array([se3.as_matrix(pose)[:3, :3] for pose in poses.tolist()])
    return lambda position, scale, rotation: (
        position.shape == poses[:, :3].shape and np.allclose(position, poses[:, :3], atol=1e-5)
        and np.allclose(rotation, rotations, atol=1e-5) and (scale > 0.0).all())


def test_five_frames_stand_where_the_lookup_says_and_follow(page, robot):
    page.wait_for_axes(stand_as(robot, LAST))
    tree = robot.lookup_tree('world', LAST)
    lines = np.array([[tree[parent][:3], tree[child][:3]] for parent, child in (
        ('world', 'odom'), ('odom', 'base_link'), ('base_link', 'camera'),
        ('base_link', 'gripper'))])
    page.wait_for(lambda: page.lines()[0], lambda points: (
        points.shape == lines.shape and np.allclose(points, lines, atol=1e-5)))
    feed(robot, LAST, LAST + SECOND)
    robot.time = LAST + SECOND
    page.wait_for_axes(stand_as(robot, LAST + SECOND))


def test_slider_moves_them_to_where_they_were_and_live_back(page, robot):
    page.go_to(2.525)
    page.wait_for_text('paused at 102.525')
    page.wait_for_axes(stand_as(robot, FIRST + 2_525_000_000))
    page.press('step ▶')
    page.wait_for_axes(stand_as(robot, FIRST + 2_550_000_000))
    page.press('live')
    page.wait_for_axes(stand_as(robot, LAST))
    page.press('pause')
    page.wait_for_text('paused at 110')
    page.press('play')
    page.wait_for_text('playing')


def test_time_that_was_typed_is_not_lost_to_a_live_picture(page, serving):
    *_, shown = pages_of(serving)
    slider = shown.controls.timeline._slider
    with hold_up(shown):
        page.press('live')
        page.go_to(2.5)
        page.wait_for(lambda: slider.value == 2.5)
        shown.tick(1.0)
    page.wait_for_text('paused at 102.5')


def test_time_that_was_typed_is_not_lost_to_reports_of_the_browser(page, serving):
    *_, shown = pages_of(serving)
    ended = threading.Event()

    def beat():
        while not ended.wait(0.02):  # far more often than usual
            shown._browser.beat()

    beating = threading.Thread(target=beat)
    beating.start()
    try:
        for seconds in (2.3, 4.7, 0.6):
            page.go_to(seconds)
            page.wait_for_text(f'paused at {100.0 + seconds:.1f}')
    finally:
        ended.set()
        beating.join()


def test_chosen_fixed_frame_is_kept_on_a_live_page(
        page, robot, serving):
    *_, shown = pages_of(serving)
    for frame in ('gripper', 'world'):
        with hold_up(shown):
            page.field('fixed frame').fill(frame)
            page.page.get_by_role('option', name=frame, exact=True).click()
            page.wait_for(lambda frame=frame: shown.controls.frames._fixed.value == frame)
            shown.tick(1.0)
        page.wait_for_axes(stand_as(robot, LAST, frame))


def test_frame_that_stops_turns_grey_where_it_was(page, robot):
    page.wait_for_axes(stand_as(robot, LAST))
    feed(robot, LAST, LAST + 3 * SECOND, ['odom', 'base_link'])
    robot.time = LAST + 3 * SECOND
    page.wait_for_text('5 frames, 1 stale')
    # The parts of a picture come one after the other.
    page.wait_for_axes(lambda _, scale, __: len(scale) == 5 and (scale == 0.0).sum() == 1)
    page.wait_for(lambda: page.scene()['stale'] == [1])
    place = robot.lookup('world', 'gripper', LAST).translation

    def is_grey(lines):
        points, colors = lines
        found = colors[np.isclose(points[:, 1], place, atol=1e-5).all(axis=1), 0]
        return len(found) == 1 and np.ptp(found) == 0.0

    page.wait_for(page.lines, is_grey)
    page.wait_for(lambda: page.frame_button('gripper').evaluate(
        'x => getComputedStyle(x).fontStyle'), lambda style: 'italic' in style)


def test_tree_may_change_while_it_is_looked_at(page, robot):
    page.wait_for_axes(stand_as(robot, LAST))
    robot.insert('gripper', 'tool', 0, Pose(z=0.1), static=True)
    page.wait_for_text('6 frames')
    page.wait_for_axes(stand_as(robot, LAST))
    for stamp in range(LAST, LAST + SECOND, SECOND // 20):
        robot.insert('world', 'gripper', stamp, Pose(x=5.0), strict=False)
    feed(robot, LAST, LAST + SECOND, ['odom', 'base_link'])
    robot.time = LAST + SECOND
    page.wait_for_axes(stand_as(robot, LAST + SECOND - SECOND // 20))
    robot.clear()
    feed(robot, SECOND, 2 * SECOND)
    robot.time = 2 * SECOND
    page.wait_for_text('live at 2.0')
    page.wait_for_axes(stand_as(robot, 2 * SECOND))
    robot.remove_frame('tool')
    page.wait_for_text('5 frames')


def test_click_in_the_list_or_on_the_axes_chooses_a_frame(new_page, robot):
    facts = new_page.page.locator('.tf-facts')
    new_page.choose('camera')
    new_page.turn_to('chosen')
    facts.filter(has_text='static').wait_for()
    assert 'base_link' in facts.inner_text()
    new_page.page.set_viewport_size({'width': 1000, 'height': 480})
    new_page.press('look at it')
    # While the view turns to the frame, a click may meet another one; and a second click on the
    # chosen frame deselects it.
    camera = list(robot.lookup_tree('world', LAST)).index('camera')
    new_page.wait_for(lambda: len(new_page.names()))
    pixel = new_page.wait_for(lambda: new_page.pixels()[camera], lambda pixel: np.allclose(
        pixel, new_page.picture().reshape(2, 2).mean(axis=0), atol=1.0))
    new_page.choose('world')
    new_page.turn_to('chosen')
    facts.filter(has_text='it is a root').wait_for()
    new_page.page.mouse.click(*pixel)
    facts.filter(has_text='static').wait_for()


def test_chosen_frame_can_be_hidden_and_leave_a_trail(page):
    page.choose('gripper')
    page.turn_to('chosen')
    page.page.get_by_role('checkbox', name='show it').uncheck()
    page.wait_for_axes(lambda _, scale, __: (scale == 0.0).sum() == 1)
    page.page.get_by_role('checkbox', name='trail').check()
    page.wait_for_count('node.geometry?.attributes?.instanceStart ? 1 : 0', 2)
    page.page.get_by_role('checkbox', name='trail').uncheck()
    page.page.get_by_role('checkbox', name='show it').check()
    page.wait_for_axes(lambda _, scale, __: (scale > 0.0).all())
    page.choose('gripper')  # a second click deselects it


def test_followed_frame_stays_where_it_is_on_the_page(new_page, robot, serving):
    position, _, _ = new_page.wait_for_axes(stand_as(robot, LAST))
    gripper = list(robot.lookup_tree('world', LAST)).index('gripper')
    new_page.choose('gripper')
    new_page.turn_to('chosen')
    new_page.page.get_by_role('checkbox', name='follow').check()
    # It stays where it is drawn after the server has received the request.
    *_, shown = pages_of(serving)
    new_page.wait_for(lambda: shown.controls.chosen.followed == 'gripper')
    shown.tick(1.0)
    feed(robot, LAST, LAST + SECOND)
    robot.time = LAST + SECOND
    new_page.wait_for_axes(
        lambda now, _, __: np.allclose(now[gripper], position[gripper], atol=1e-5)
        and np.linalg.norm(now[0] - position[0]) > 0.1)
    new_page.page.get_by_role('checkbox', name='follow').uncheck()
    new_page.turn_to('look')
    new_page.press('see all')
    new_page.wait_for_axes(stand_as(robot, LAST + SECOND))


def test_ellipsoid_is_where_the_chosen_frame_may_be(new_page, robot):
    def two_sigma(frame, stamp):
        pose, covariance = robot.lookup_uncertain('world', frame, stamp)
        return lambda matrix: (
            np.allclose(matrix[:3, 3], pose.translation, atol=1e-5) and np.allclose(
                matrix[:3, :3] @ matrix[:3, :3].T, 4.0 * covariance[:3, :3], atol=1e-5))

    new_page.choose('camera')
    assert not len(new_page.ellipsoids())
    for stamp, variance in ((FIRST, 0.01), (LAST, 0.09)):
        robot.insert('odom', 'base_link', stamp, pose_at(stamp, 1), strict=False,
                     covariance=np.diag([variance, 0.02, 0.03, 0.001, 0.002, 0.003]))
    new_page.wait_for_ellipsoid(two_sigma('camera', LAST))
    new_page.turn_to('chosen')
    new_page.page.locator('.tf-facts').filter(has_text='share of odom -> base_link').wait_for()
    new_page.go_to(2.5)
    new_page.wait_for_ellipsoid(two_sigma('camera', FIRST + 5 * SECOND // 2))
    new_page.press('live')
    new_page.choose('gripper')
    new_page.wait_for_ellipsoid(two_sigma('gripper', LAST))
    new_page.choose('odom')
    new_page.wait_for_count(SPHERE, 0)


def test_no_name_covers_another_however_near_one_comes(new_page, robot):
    rng = np.random.default_rng(7)
    for number, place in enumerate(rng.uniform(-0.5, 0.5, (40, 3)).tolist()):
        robot.insert('base_link', f'a_sensor_with_a_name_{number}', 0, Pose(*place), static=True)
    new_page.wait_for_text('45 frames')
    new_page.page.set_viewport_size({'width': 1000, 'height': 600})
    new_page.press('see the robot')
    for _ in range(3):
        new_page.wait_for(new_page.names, lambda names: len(names) > 5 and not overlaps(names))
        new_page.page.mouse.move(300, 300)
        new_page.page.mouse.wheel(0, -300)


def test_address_keeps_what_is_shown_for_a_reload_and_for_others(new_page, robot, window, serving):
    new_page.go_to(2.5)
    new_page.choose('camera')
    new_page.page.wait_for_url('**chosen=camera**')
    new_page.page.wait_for_url('**t=102.500000000**')
    query = '&' + new_page.page.url.partition('fixedDpr=0.5&')[2]
    shared = OpenPage(window, serving.url, query)
    shared.wait_for_text('paused at 102.5')
    shared.wait_for_axes(stand_as(robot, FIRST + 5 * SECOND // 2))
    shared.turn_to('chosen')
    shared.page.locator('.tf-facts', has_text='camera').wait_for()
    shared.page.reload()
    shared.wait_for_text('paused at 102.5')
    assert not shared.complaints
    shared.page.close()
    new_page.choose('camera')  # a second click deselects it
    new_page.page.wait_for_function("!location.search.includes('chosen')")


def test_search_leaves_what_it_finds(page):
    page.field('search').fill('CAM')
    page.frame_button('gripper').wait_for(state='detached')
    assert page.frame_button('camera').count() == 1
    page.field('search').fill('')
    page.frame_button('gripper').wait_for()


def test_finding_marks_its_frames(page, robot):
    robot.findings = [Finding('made-up', Severity.WARNING, ('odom', 'base_link'), ('/wheels',),
                              'It is <i>not</i> so.')]
    page.choose('odom')
    page.turn_to('findings')
    page.frame_button('made-up').click()
    page.page.get_by_text('It is <i>not</i> so.').wait_for()
    page.wait_for_count(POINTS, 2)
    robot.findings = []
    page.page.get_by_text('no problems found').wait_for()
    page.wait_for_count(POINTS, 1)
    page.choose('odom')
    page.wait_for_count(POINTS, 0)


def test_links_of_a_robot_stand_on_their_frames(page, robot):
    page.wait_for_count(LINK, 1)
    robot.remove_frame('camera')
    page.wait_for_count(LINK, 0)


SPHERE = 'node.isMesh && /Icosahedron|Sphere/.test(node.geometry.type) ? 1 : 0'
POINTS = 'node.isPoints ? node.geometry.attributes.position.count : 0'
LINK = ('node.isMesh && !node.isInstancedMesh && node.geometry.attributes.position.count === 3'
        ' ? 1 : 0')


def test_page_fits_a_phone_in_the_dark(page):
    page.page.set_viewport_size({'width': 390, 'height': 800})
    page.turn_to('look')
    page.page.get_by_role('checkbox', name='dark', exact=True).check()
    page.page.wait_for_function(
        "document.documentElement.getAttribute('data-mantine-color-scheme') === 'dark'")
    page.wait_for(lambda: page.page.evaluate('document.documentElement.scrollWidth'),
                  lambda width: width <= 390)
    for name in ('pause', 'live'):
        page.wait_for(page.page.get_by_role('button', name=name, exact=True).bounding_box,
                      lambda box: box['x'] >= 0 and box['x'] + box['width'] <= 390)
    page.page.get_by_role('checkbox', name='dark', exact=True).uncheck()
    page.page.set_viewport_size({'width': 640, 'height': 480})


def test_pages_are_independent_and_a_closed_one_costs_nothing(window):
    robot = Robot()
    with serve(robot) as serving:
        first, second = OpenPage(window, serving.url), OpenPage(window, serving.url)
        first.go_to(1.0)
        first.wait_for_text('paused at 101.0')
        second.wait_for_text('live at 110.0')
        second.wait_for_axes(stand_as(robot, LAST))
        for page in (first, second):
            page.page.close()
        serving.wait_until_closed()
        looked = robot.looked
        feed(robot, LAST, LAST + SECOND)
        assert robot.looked == looked
