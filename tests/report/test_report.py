"""The report in a real browser: it shows the kit, answers, and asks nobody for anything."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from drkid.export.bill_of_materials import moulding, piece_row
from drkid.export.document import KitDocument
from drkid.export.kit_document import parts_list, printed_meshes
from drkid.mesh import TriMesh
from drkid.report.part_picture import part_picture
from drkid.report.report import json_in_html, report_html
from drkid.report.scene import Scene
from drkid.report.tables import number


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


def table_under(page, heading: str) -> list[list[str]]:
    """The cells of the first table under a heading, as a reader sees them."""
    rows = page.locator(f"section:has(> h2:text-is('{heading}')) table").first.locator("tr")
    return [row.locator("th, td").all_inner_texts() for row in rows.all()]


def test_the_parts_list_has_every_part_with_its_picture_count_mass_and_what_rods_are_cut_to(opened, kit):
    rows = parts_list(kit, printed_meshes(kit))
    head, *lines, sums = table_under(opened.page, "Parts list")
    assert head == ["picture", "part", "count", "spare", "volume, mm³", "mass, g", "all: mass, g"]  # no prices
    assert len(lines) == len(rows)
    for row, cells in zip(rows, lines, strict=True):
        assert cells[1].startswith(row.part.replace("_", " "))
        assert (row.file or f"cut to {row.length:g} mm") in cells[1]
        assert cells[2:4] == [str(row.count), str(row.spare)]
        assert cells[5] == ("" if row.mass_g is None else number(row.mass_g))
    assert int(sums[2]) == sum(row.count for row in rows if row.file)
    pictures = opened.page.locator("section:has(> h2:text-is('Parts list')) img")
    assert pictures.count() == len([row for row in rows if row.file])
    assert all(image.evaluate("image => image.naturalWidth") > 90 for image in pictures.all())
    assert "--mould-price" in opened.page.inner_text("section:has(> h2:text-is('Printing or moulding'))")


def test_moulding_stands_beside_printing_where_prices_are_given(browser, kit, scene):
    spec = kit.spec.model_copy(update={"price_per_kg": 300.0, "mould_price": 2500.0, "spares": "5%"})
    rows = parts_list(replace(kit, spec=spec), printed_meshes(kit))
    page = browser.new_page()
    page.set_content(report_html(scene, spec, rows, {}))
    head, printed, moulded = table_under(page, "Printing or moulding")
    found = moulding(rows, spec)
    assert f"{found.break_even_kits} kits" in head
    at = head.index(f"{found.break_even_kits} kits")
    costs = [float(cells[at].replace(",", "")) for cells in (moulded, printed)]
    assert costs[0] <= costs[1]
    assert float(moulded[2].replace(",", "")) == found.moulds_cost
    text = page.inner_text("section:has(> h2:text-is('Printing or moulding'))")
    assert f"Moulds pay from {found.break_even_kits} kits on" in text
    assert f"{rows[0].break_even_count} copies" in text
    assert table_under(page, "Parts list")[0][-1] == "all: cost"
    page.close()


def test_every_figure_stands_in_a_row_of_its_own(opened, kit):
    opened.page.click("summary")
    figures = dict(table_under(opened.page, "Everything measured")[1:])
    assert figures["pieces"] == str(len(kit.assembly.pieces))
    assert figures["assembly closure settled"] in {"yes", "no"}
    assert figures["groove choices 1 moulds"] == str(kit.metrics.groove_choices[0].moulds)
    assert not any("{" in value for value in figures.values())


def repeated(scene: Scene, times: int) -> Scene:
    """The kit so many times over, as if it were one kit, each copy with shapes of its own."""
    plain = scene.document.model_dump(by_alias=True)
    faces, corners = len(scene.assembled.faces), len(scene.assembled.vertices)
    many = {name: [] for name in ("classes", "pieces", "joints", "assembly")}

    def file(name, k):
        return name.replace(".stl", f"_{k}.stl")

    for k in range(times):
        for one in plain["classes"]:
            parts = [part | {"file": file(part["file"], k)} for part in one["parts"]]
            many["classes"].append(one | {"id": f"{one['id']}{k}", "parts": parts})
        for one in plain["pieces"]:
            moved = {"face": one["face"] + k * faces, "corners": [v + k * corners for v in one["corners"]]}
            many["pieces"].append(one | moved | {"class": f"{one['class']}{k}", "part": file(one["part"], k)})
        for one in plain["joints"]:
            many["joints"].append(one | {"faces": tuple(f + k * faces for f in one["faces"])})
        for one in plain["assembly"]:
            many["assembly"].append(
                {"step": one["step"] + k * faces, "face": one["face"] + k * faces, "joins": one["joins"]}
            )
    mesh = TriMesh(
        np.vstack([scene.assembled.vertices] * times),
        np.vstack([scene.assembled.faces + k * corners for k in range(times)]),
    )
    parts = {file(name, k): part for k in range(times) for name, part in scene.parts.items()}
    return Scene(KitDocument.model_validate(plain | many), parts, scene.surface, mesh)


def test_it_stays_small(documents, scene, kit):
    """One kit, and one of 540 pieces of as many shapes as nine such kits have, which is more than any real one."""
    assert (documents / "report.html").stat().st_size < 1_000_000
    large = repeated(scene, 9)
    rows = [piece_row(file, 0, 5, 2000.0, kit.spec) for file in large.parts]
    picture = part_picture(next(iter(scene.parts.values())), "#3366CC")[1]
    page = report_html(large, kit.spec, rows, dict.fromkeys(large.parts, picture))
    assert len(large.document.pieces) == 540
    assert len(large.parts) > 30
    assert len(page.encode()) < 2_500_000
