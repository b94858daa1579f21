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
    assert moulding(rows_of(KitSpec(mould_price=3000)), KitSpec(mould_price=3000)) is None
    assert moulding(rows_of(KitSpec(price_per_kg=30)), KitSpec(price_per_kg=30)) is None


def test_moulds_pay_from_the_kit_at_which_they_cost_less():
    spec = KitSpec(price_per_kg=300, mould_price=2500, moulded_price_per_piece=0.05)
    found = moulding(rows_of(spec), spec)
    assert (found.moulds, found.moulds_cost) == (2, 5000)

    def printed(kits):
        return kits * found.printed_kit_cost

    def moulded(kits):
        return found.moulds_cost + kits * found.moulded_kit_cost

    kits = found.break_even_kits
    assert moulded(kits) <= printed(kits)
    assert moulded(kits - 1) > printed(kits - 1)


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
