import re
from dataclasses import replace

import pytest

from drkid.export.bill_of_materials import moulding, piece_row
from drkid.export.kit_document import parts_list, printed_meshes
from drkid.report.parts_list import moulding_section, parts_table
from drkid.spec import KitSpec


@pytest.mark.parametrize("with_pictures", [True, False])
def test_every_printed_part_of_the_list_has_its_picture(kit, with_pictures):
    meshes = printed_meshes(kit)
    rows = parts_list(kit, meshes)
    pictures = dict.fromkeys(meshes, b"png") if with_pictures else {}
    html = parts_table(rows, pictures, kit.spec)
    assert html.count("<img") == (len(meshes) if with_pictures else 0)
    assert all(row.part.replace("_", " ") in html for row in rows)


@pytest.mark.parametrize("prices", [{}, {"price_per_kg": 30.0}, {"price_per_kg": 30.0, "mould_price": 900.0}])
def test_what_is_not_known_is_left_out_and_what_it_takes_is_said(kit, prices):
    spec = KitSpec.parse({**kit.spec.model_dump(mode="json"), **prices})
    rows = parts_list(replace(kit, spec=spec), printed_meshes(kit))
    assert ("all: cost" in parts_table(rows, {}, spec)) == ("price_per_kg" in prices)
    text = moulding_section(moulding(rows, spec), rows, spec)
    assert ("--mould-price" in text) == ("mould_price" not in prices)
    printed = sum(1 for row in rows if row.file)
    assert re.search(rf"\b{printed} moulds|<td class=\"n\">{printed}</td>", text)


def test_moulds_that_never_pay_are_said_to():
    spec = KitSpec(price_per_kg=1, mould_price=900, moulded_price_per_piece=3)
    rows = [piece_row("parts/A.stl", 0, 20, 1000.0, spec)]
    assert "never pay" in moulding_section(moulding(rows, spec), rows, spec)
