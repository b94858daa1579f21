"""The report in a real browser: it shows the kit, answers, and asks nobody for anything."""

import io

import numpy as np
import pytest
from PIL import Image

from drkid.report.report import json_in_html


def picture(watched) -> np.ndarray:
    """What the 3D part shows."""
    watched.page.wait_for_timeout(300)
    shot = watched.page.locator("#view").screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def middle_of_canvas(watched) -> tuple[float, float]:
    box = watched.page.locator("#view").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.fixture
def opened(watched, documents):
    watched.page.goto((documents / "report.html").as_uri())
    watched.page.wait_for_selector("#told p")
    return watched


def test_it_shows_the_kit_answers_a_click_and_asks_nobody(opened, documents):
    whole = picture(opened)
    assert len(np.unique(whole.reshape(-1, 3), axis=0)) > 50
    opened.page.mouse.click(*middle_of_canvas(opened))
    told = opened.page.inner_text("#told")
    assert "class" in told
    assert "Neighbours" in told
    assert "Error" in told
    opened.page.fill("#explode", "60")
    apart = picture(opened)
    assert (np.abs(apart - whole).max(axis=2) > 20).mean() > 0.02
    assert opened.errors == []
    assert opened.requests == [(documents / "report.html").as_uri()]


def test_steps_colours_ghost_and_keys_change_the_picture(opened):
    before = picture(opened)
    for act in (
        lambda page: page.fill("#step", "5"),
        lambda page: page.click("#forth"),
        lambda page: page.fill("#step", "60"),
        lambda page: page.select_option("#colour", "distance"),
        lambda page: page.check("#ghost"),
        lambda page: page.locator("#view").press("ArrowLeft"),
    ):
        act(opened.page)
        after = picture(opened)
        assert (after != before).any()
        before = after
    assert opened.page.inner_text("#stepword") == "60"
    assert opened.errors == []


def test_a_piece_is_found_by_its_number(opened, scene):
    opened.page.fill("#piece", "7")
    opened.page.locator("#piece").press("Enter")
    piece = int(np.flatnonzero(scene.piece_step == 7)[0])
    told = opened.page.inner_text("#told")
    assert f"Piece 7: class {scene.document.pieces[piece].class_}" in told
    assert f"face {scene.document.pieces[piece].face}" in told


def test_a_phone_needs_no_sideways_scrolling(opened):
    opened.page.set_viewport_size({"width": 360, "height": 740})
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 360


def test_without_webgl_it_says_so_and_the_rest_stands(browser, documents):
    page = browser.new_page()
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto((documents / "report.html").as_uri())
    assert page.locator("#fallback").is_visible()
    assert page.locator("svg.plot").count() == 2
    page.close()


def test_names_of_files_are_text_and_never_markup(documents):
    text = (documents / "report.html").read_text()
    assert "<img" not in text.replace('<img src="data:image/png;base64,', "")  # the pictures of the parts
    assert text.count("</script>") == 3
    assert "&lt;/script&gt;&lt;img" in text


def test_json_in_html_holds_no_markup():
    text = json_in_html({"name": "</script>&<!--"})
    assert not set("<>&") & set(text)


def test_it_stays_small(documents):
    assert (documents / "report.html").stat().st_size < 1_000_000
