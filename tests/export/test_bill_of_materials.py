from dataclasses import replace

import pytest

from drkid.export.bill_of_materials import connector_row, moulding, piece_row, rod_row, spare_count
from drkid.export.kit_document import kit_summary
from drkid.spec import KitSpec


@pytest.mark.parametrize(
    ("spares", "count", "wanted"), [("0", 40, 0), ("3", 40, 3), ("5%", 40, 2), ("5%", 41, 3), ("0.5%", 10, 1)]
)
def test_spares_are_a_number_or_a_percentage_rounded_up(spares, count, wanted):
    assert spare_count(spares, count) == wanted


def rows_of(spec: KitSpec):
    return [
        piece_row("parts/A.stl", 0, 100, 2000.0, spec),
        connector_row("connector_half", "parts/connector_half.stl", 300, 100.0, spec),
        rod_row(2.0, 6.4, 150, spec),
    ]


def test_costs_are_the_mass_times_the_price():
    spec = KitSpec(spares="5%", price_per_kg=30)
    piece, half, rod = rows_of(spec)
    assert piece.mass_g == pytest.approx(2.48)
    assert piece.cost == pytest.approx(0.0744)
    assert piece.total_cost == pytest.approx(105 * 0.0744)
    assert (half.spare, rod.spare, rod.total_length) == (15, 8, pytest.approx(158 * 6.4))
    assert rod.cost is None


def test_without_a_price_nothing_costs_anything_and_nothing_is_compared():
    assert all(row.cost is None and row.total_cost is None for row in rows_of(KitSpec()))
    for spec in (KitSpec(), KitSpec(price_per_kg=30)):
        assert moulding(rows_of(spec), spec) is None
        assert all(row.mould_cost is row.moulded_cost is row.break_even_count is None for row in rows_of(spec))


def test_moulds_pay_from_the_kit_at_which_they_cost_less():
    spec = KitSpec(price_per_kg=300, mould_price=2500, moulded_price_per_piece=0.05)
    found = moulding(rows_of(spec), spec)
    assert (found.moulds, found.parts, found.moulds_cost) == (2, 400, 5000)

    def printed(kits):
        return kits * found.printed_kit_cost

    def moulded(kits):
        return found.moulds_cost + kits * found.moulded_kit_cost

    kits = found.break_even_kits
    assert moulded(kits) <= printed(kits)
    assert moulded(kits - 1) > printed(kits - 1)


@pytest.mark.parametrize(("price", "moulded"), [(300.0, 0.05), (30.0, 0.01), (900.0, 0.5)])
def test_the_mould_of_a_part_pays_from_the_copy_at_which_it_costs_less(price, moulded):
    piece, half, rod = rows_of(KitSpec(price_per_kg=price, mould_price=2500, moulded_price_per_piece=moulded))
    for row in (piece, half):
        assert (row.mould_cost, row.moulded_cost) == (2500, moulded)
        if row.break_even_count is None:
            assert row.cost <= moulded
        else:
            assert 2500 + row.break_even_count * moulded <= row.break_even_count * row.cost * (1 + 1e-9)
            assert 2500 + (row.break_even_count - 1) * moulded > (row.break_even_count - 1) * row.cost
    assert rod.mould_cost is rod.break_even_count is None


def test_rows_name_their_part_its_hand_and_its_picture():
    row = piece_row("parts/A2_left.stl", 0, 3, 100.0, KitSpec())
    assert (row.part, row.picture) == ("piece A2 left", "pictures/A2_left.png")
    assert piece_row("parts/A.stl", 0, 3, 100.0, KitSpec(documents=False)).picture is None


def test_dear_moulding_never_pays():
    spec = KitSpec(price_per_kg=30, mould_price=2500, moulded_price_per_piece=5)
    assert moulding(rows_of(spec), spec).break_even_kits is None


def test_spares_cost_nothing_in_the_comparison():
    plain = KitSpec(price_per_kg=300, mould_price=2500)
    spare = plain.model_copy(update={"spares": "50%"})
    assert moulding(rows_of(plain), plain) == replace(moulding(rows_of(spare), spare))


def test_the_summary_has_costs_where_prices_are_given(kit):
    assert "cost" not in kit_summary(kit)
    priced = replace(kit, spec=kit.spec.model_copy(update={"price_per_kg": 30.0, "mould_price": 1000.0}))
    found = kit_summary(priced)["cost"]
    assert found["printed"] == pytest.approx(found["moulding"]["printed_kit_cost"])  # no spares
    assert found["moulding"]["moulds"] == len(kit.part_set.parts) + 1
