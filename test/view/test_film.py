# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Films of a page: their stamps, and their pictures from a browser that may disconnect."""

import io
import threading

from conditions import until
from hypothesis import given, strategies as st
import numpy as np
from programs import PATIENCE_S
import pytest
from tf_tree_py.view.page.browser import Film, film_stamps, MOST_FRAMES, RATE_HZ

PIL_image = pytest.importorskip('PIL.Image', reason='films need pillow')

SECOND = 1_000_000_000
WINDOW = 100 * SECOND, 110 * SECOND


@pytest.mark.parametrize(('stamp', 'seconds', 'begin', 'end'), [
    (102, 5.0, 102, 107), (108, 5.0, 105, 110), (110, 2.0, 108, 110), (103, 99.0, 100, 110)])
def test_film_begins_at_the_moment_and_stays_in_the_window(stamp, seconds, begin, end):
    stamps = film_stamps(WINDOW, stamp * SECOND, seconds, 1.0)
    assert (stamps[0], stamps[-1]) == (begin * SECOND, end * SECOND)
    np.testing.assert_allclose(np.diff(stamps), SECOND / RATE_HZ, atol=1)


@given(st.integers(100, 110), st.floats(0.1, 600.0), st.sampled_from([0.1, 1.0, 10.0]))
def test_stamps_of_a_film_are_in_the_window_and_not_too_many(stamp, seconds, speed):
    stamps = film_stamps(WINDOW, stamp * SECOND, seconds, speed)
    assert 1 <= len(stamps) <= MOST_FRAMES
    assert WINDOW[0] <= stamps[0] and stamps[-1] <= WINDOW[1]
    assert (np.diff(stamps) > 0).all()


class Client:
    """A browser that draws single-coloured pictures, until a test stops it."""

    def __init__(self, pictures=99):
        self.left = pictures
        self.sizes, self.films = [], []

    def get_render(self, height, width, timeout):
        self.left -= 1
        if self.left < 0:
            raise RuntimeError('the client is gone')
        self.sizes.append((width, height))
        return np.full((height, width, 3), 2 * len(self.sizes), np.uint8)

    def send_file_download(self, name, data, save_immediately):
        self.films.append(PIL_image.open(io.BytesIO(data)))


def recorded(film, *arguments):
    film.start(*arguments)
    for thread in threading.enumerate():
        if thread.name == 'film':
            thread.join(PATIENCE_S)
    assert film.progress is None


def test_film_has_a_picture_of_each_stamp():
    client, shown = Client(), []
    recorded(Film(client, shown.append), np.array([5, 6, 7]), (1280.0, 800.0))
    film, = client.films
    assert shown == [5, 6, 7] and film.n_frames == 3
    assert client.sizes == [(640, 400)] * 3 and film.size == (640, 400)
    assert film.info['duration'] == 100 and film.info['loop'] == 0


@pytest.mark.parametrize('pictures', [0, 2])
def test_film_of_a_browser_that_goes_away_has_the_pictures_until_then(pictures):
    client = Client(pictures)
    recorded(Film(client, lambda stamp: None), np.arange(9), (300.0, 200.0))
    assert [film.n_frames for film in client.films] == [pictures] * bool(pictures)


def test_film_can_be_stopped_and_another_one_does_not_start_meanwhile():
    client, reached = Client(), threading.Event()
    go_on = threading.Event()

    def show(stamp):
        reached.set()
        go_on.wait(PATIENCE_S)

    film = Film(client, show)
    film.start(np.arange(50), (300.0, 200.0))
    assert reached.wait(PATIENCE_S) and film.progress == (0, 50)
    film.start(np.arange(2), (300.0, 200.0))
    film.stop()
    go_on.set()
    until(lambda: film.progress is None and client.films)
    assert [each.n_frames if hasattr(each, 'n_frames') else 1 for each in client.films] == [1]
