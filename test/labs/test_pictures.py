# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The text in a picture is readable: no text overlaps another, none is cut off."""

from itertools import combinations
import resource

from lab_reports import report_of
import pytest
from tf_tree_py.labs.catalogue import LABS
from tf_tree_py.labs.report import figure_of, NoPicture, save

pytest.importorskip('matplotlib')


def words(figure, monkeypatch):
    """Return each drawn text, whether it is rotated, and its box, in pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Text
    boxes = {}
    plain_draw = Text.draw

    def draw(text, renderer):
        plain_draw(text, renderer)
        if text.get_text().strip() and text.get_visible():
            boxes[text] = Text.get_window_extent(text)

    monkeypatch.setattr(Text, 'draw', draw)
    FigureCanvasAgg(figure).draw()
    return [(text.get_text(), text.get_rotation() % 90.0 != 0.0, box)
            for text, box in boxes.items()]


@pytest.mark.parametrize('name', LABS)
def test_no_words_stand_on_others_or_are_cut_off(name, monkeypatch):
    figure = figure_of(report_of(name).draw)
    boxes = words(figure, monkeypatch)
    assert len(boxes) > 10
    for text, _, box in boxes:
        assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1, text
        assert figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1, text
    for (one, leans, its), (other, leans_too, others) in combinations(boxes, 2):
        # The boxes of two rotated texts side by side overlap, but the texts do not.
        apart = not its.padded(-1.0).overlaps(others.padded(-1.0))
        assert apart or (leans and leans_too), (one, other)


def test_picture_that_is_there_stays_where_there_is_no_place_for_another(tmp_path):
    pictures = save(lambda figure: figure.text(0.5, 0.5, 'one'), tmp_path, 'numbers')
    before = [picture.read_bytes() for picture in pictures]
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(NoPicture, match='numbers.png: File too large'):
            save(lambda figure: figure.text(0.5, 0.5, 'another'), tmp_path, 'numbers')
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [picture.read_bytes() for picture in pictures] == before
    assert sorted(tmp_path.iterdir()) == sorted(pictures)
