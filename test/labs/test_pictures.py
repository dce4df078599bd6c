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

"""What is written in a picture can be read: no words on others, none cut off at the edge."""

from itertools import combinations

from lab_reports import report_of
import pytest
from tf_tree_py.labs.catalogue import LABS
from tf_tree_py.labs.pictures import figure_of

pytest.importorskip('matplotlib')


def words(figure, monkeypatch):
    """Return each text that is drawn, whether it leans, and the box that it fills, in pixels."""
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
        # The boxes of two leaning texts beside each other overlap, and the texts do not.
        apart = not its.padded(-1.0).overlaps(others.padded(-1.0))
        assert apart or (leans and leans_too), (one, other)
