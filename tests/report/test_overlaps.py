"""No two texts of a figure lie over each other."""

from __future__ import annotations

from itertools import combinations

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from vinesexp.figures.gallery import FAMILIES, fit_to_width
from vinesexp.results import CampaignResults

#: Points that two boxes may share: a box is a little larger than its letters.
SLACK = 1.5


def texts(figure):
    """Every visible text that holds something, with its box in points."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    scale = 72.0 / figure.dpi
    outside = {
        label
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for tick in axis.get_major_ticks()
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
        for label in (tick.label1, tick.label2)
    }
    found = []
    for text in figure.findobj(Text):
        if not text.get_visible() or not text.get_text().strip() or text in outside:
            continue
        box = text.get_window_extent(renderer)
        found.append((text.get_text(), *(scale * edge for edge in box.extents)))
    return found


def overlapping(found):
    def over(a, b):
        across = min(a[3], b[3]) - max(a[1], b[1])
        up = min(a[4], b[4]) - max(a[2], b[2])
        return across > SLACK and up > SLACK

    return [(a[0], b[0]) for a, b in combinations(found, 2) if over(a, b)]


@pytest.mark.long
@pytest.mark.parametrize("campaign", ["bare", "drops", "two_levels"])
def test_texts_of_figures_do_not_overlap(campaign, request):
    """Figures of all records together; those of single ones are the same in every campaign."""
    made = request.getfixturevalue(campaign)
    for figure, entry in FAMILIES["results"](CampaignResults(made.results, made.campaign)):
        assert overlapping(texts(figure)) == [], entry.name


@pytest.mark.long
@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_figures_fit_the_page_and_a_column_of_a_journal(family, full):
    """Nothing overlaps, nothing leaves the column, and text can be read (6 pt and more)."""
    for figure, entry in FAMILIES[family](CampaignResults(full.results, full.campaign)):
        assert overlapping(texts(figure)) == [], entry.name
        fit_to_width(figure, 190.0)  # the page is 183 mm, so that this need not be drawn again
        assert figure.get_size_inches()[0] * 25.4 == pytest.approx(190.0)
        fit_to_width(figure, 90.0)
        assert figure.get_size_inches()[0] * 25.4 == pytest.approx(90.0)
        found = texts(figure)
        assert overlapping(found) == [], entry.name
        right = figure.get_size_inches()[0] * 72.0
        for text, left, _, end, _ in found:
            assert left > -SLACK, (entry.name, text)
            assert end < right + SLACK, (entry.name, text)
        assert min(text.get_fontsize() for text in figure.findobj(Text)) >= 5.5


def test_texts_that_do_overlap_are_noticed():
    from vinesexp.figures.style import new_figure

    figure, (axis,) = new_figure()
    axis.text(0.5, 0.5, "one thing")
    axis.text(0.52, 0.5, "another")
    assert overlapping(texts(figure)) == [("one thing", "another")]
