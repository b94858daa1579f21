import pytest
from hypothesis import given
from hypothesis import strategies as st

import drkid
from drkid.errors import SpecError
from drkid.spec import MOST_WALKED_FACES, PRINTERS, PROCESSES, UNIVERSAL, UNIVERSAL_BEVEL, KitSpec, multiset_words


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"faces": 3}, ["faces", "greater than or equal to 4", "3"]),
        ({"faces": 173}, ["173", "even"]),
        ({"faces": 8, "classes": 9}, ["classes is 9", "8 faces"]),
        ({"faces": 8, "vertices": 6}, ["both given"]),
        ({"thickness_mm": -1}, ["thickness_mm", "greater than 0", "-1"]),
        ({"tolerance_percent": float("nan")}, ["tolerance_percent", "nan"]),
        ({"tolerance_percent": 0}, ["tolerance_percent", "greater than 0"]),
        ({"rounds": -1}, ["rounds", "greater than or equal to 0", "-1"]),
        ({"seconds": 0}, ["seconds", "greater than 0"]),
        ({"knuckles": 3}, ["knuckles is 3", "even"]),
        ({"size_mm": 200, "fit": True}, ["size_mm and fit are both given"]),
        ({"size_mm": 200, "mean_edge_mm": 30}, ["size_mm and mean_edge_mm"]),
        ({"palette": "30,35", "mean_edge_mm": 30}, ["mean_edge_mm and palette"]),
        ({"process": "wood"}, ["process", "'fdm'", "wood"]),
        ({"spacing": "1,2"}, ["spacing"]),
        ({"spacing": "1,2,0"}, ["spacing", "greater than 0"]),
        ({"colour": 1}, ["no parameter colour"]),
        ({"palette": "short,long"}, ["palette", "universal", "30,35.1", "short,long"]),
        ({"palette": "30"}, ["palette", "two or three", "not 1"]),
        ({"palette": [20, 25, 30, 35]}, ["palette", "two or three", "not 4"]),
        ({"palette": "35.1,30"}, ["palette", "ascending", "35.1,30"]),
        ({"palette": "30,30.8"}, ["palette", "1.03 times"]),
        ({"palette": "30,49"}, ["palette", "1.6 times"]),
        ({"palette": "30,36,49"}, ["palette", "1.6 times"]),
        ({"palette": "0,30"}, ["palette", "greater than 0"]),
        ({"palette": "nan,30"}, ["palette", "finite"]),
        ({"palette": "30,35", "like": "kit"}, ["like and palette are both given"]),
        ({"multisets": "ssl", "like": "kit"}, ["like and multisets are both given"]),
        ({"palette": "30,35", "method": "pressure"}, ["palette is given", "pressure", "--method palette"]),
        ({"like": "kit", "method": "pressure"}, ["like is given", "pressure"]),
        ({"multisets": "ssl,sll", "method": "pressure"}, ["multisets is given", "pressure"]),
        ({"palette": "30,35", "classes": 5}, ["classes is 5", "4 kinds of triangles at most"]),
        ({"palette": "30,35,40", "classes": 11}, ["classes is 11", "10 kinds of triangles at most"]),
        ({"multisets": "ssl,sll", "classes": 3}, ["classes is 3", "are 2", "not both"]),
        ({"multisets": "aab,abc", "palette": "30,35"}, ["aab,abc name 3 lengths", "palette gives 2"]),
        ({"multisets": "short"}, ["multisets", "three letters", "short"]),
        ({"multisets": "sss"}, ["multisets", "each length occurs", "l does not"]),
        ({"multisets": "aab,abb"}, ["multisets", "c does not"]),
        ({"bevel_degrees": "60"}, ["bevel_degrees", "60"]),
        ({"bevel_degrees": "60,170"}, ["bevel_degrees", "130"]),
        ({"bevel_degrees": "60,90", "thickening": "mean_normal"}, ["bevel_degrees", "mean_normal", "bisector"]),
        ({"printer": "ender-2"}, ["printer", "'ender-3'", "ender-2"]),
        ({"printer": "prusa-mk4", "bed_mm": "300x300x300"}, ["printer is prusa-mk4", "bed_mm", "one of them"]),
        ({"bed_mm": "300x300"}, ["bed_mm"]),
        ({"bed_mm": "300x300xhigh"}, ["bed_mm", "number"]),
        ({"bed_mm": "0x300x300"}, ["bed_mm", "greater than 0"]),
        ({"spares": "-1"}, ["spares", "whole number", "5%", "-1"]),
        ({"spares": "2.5"}, ["spares", "whole number", "2.5"]),
        ({"spares": "-5%"}, ["spares", "percentage", "-5%"]),
        ({"spares": "nan%"}, ["spares", "percentage", "nan%"]),
        ({"spares": "inf%"}, ["spares", "percentage"]),
        ({"spares": "some"}, ["spares", "whole number", "some"]),
        ({"spares": ""}, ["spares", "whole number"]),
        ({"price_per_kg": -1}, ["price_per_kg", "greater than or equal to 0", "-1"]),
        ({"price_per_kg": float("inf")}, ["price_per_kg", "finite"]),
        ({"price_per_kg": 30, "mould_price": -1}, ["mould_price", "greater than or equal to 0"]),
        ({"mould_price": 900}, ["mould_price is given", "price_per_kg is not"]),
        ({"moulded_price_per_piece": -0.1}, ["moulded_price_per_piece", "greater than or equal to 0"]),
        ({"paper": "a5"}, ["paper", "'a4'", "a5"]),
        ({"net_scale": 0}, ["net_scale", "greater than 0"]),
        ({"net_on_one_page": "perhaps"}, ["net_on_one_page", "perhaps"]),
        ({"documents": "some"}, ["documents", "some"]),
        ({"merge": 2, "patch": "curved"}, ["patch is curved", "merge is 2", "give one"]),
        ({"merge": 2, "bevel_variants": 2}, ["bevel_variants is 2", "merge is 2", "bevels of its own"]),
        ({"curved_classes": 4}, ["curved_classes is given", "--patch curved"]),
        ({"curved": "published"}, ["curved is given", "--patch curved"]),
        ({"merge": 2, "subdivision_levels": 2}, ["subdivision_levels is given", "--patch curved"]),
        ({"merge_shift_percent": 1}, ["merge_shift_percent is given", "--merge"]),
        ({"patch": "curved", "merge_tolerance_mm": 1}, ["merge_tolerance_mm is given", "--merge"]),
        ({"patch": "curved", "curved": "published", "curved_gap_mm": 1}, ["curved_gap_mm", "canonical"]),
    ],
)
def test_what_cannot_be_used_is_named(values, words):
    with pytest.raises(SpecError) as caught:
        KitSpec.parse(values)
    assert caught.value.exit_status == 2
    for word in words:
        assert word in str(caught.value)


def test_triples_are_read_as_they_are_typed():
    assert KitSpec.parse({"spacing": "16,16,15"}).spacing == (16, 16, 15)
    assert KitSpec.parse({"bed_mm": "250x210x200"}).bed_mm == (250, 210, 200)
    assert KitSpec.parse({"spacing": [1, 2, 3]}).spacing == (1, 2, 3)


@given(st.integers(0, 6), st.integers(20, 400))
def test_vertices_follow_from_faces_by_eulers_formula(genus, half):
    vertices = KitSpec(faces=2 * half).vertex_count(genus)
    edges = 3 * half
    assert vertices - edges + 2 * half == 2 - 2 * genus


def test_vertices_are_taken_as_given_and_too_few_faces_are_refused():
    assert KitSpec(vertices=50).vertex_count(3) == 50
    with pytest.raises(SpecError, match="3 handles"):
        KitSpec(faces=8).vertex_count(3)


@pytest.mark.parametrize("printer", PRINTERS)
def test_a_printer_gives_its_bed_and_agrees_with_it(printer):
    spec = KitSpec.parse({"printer": printer})
    assert spec.bed_mm == PRINTERS[printer]
    assert KitSpec.parse({"printer": printer, "bed_mm": list(PRINTERS[printer])}) == spec
    assert KitSpec.parse(spec.model_dump(mode="json")) == spec
    assert all(50 < side < 1000 for side in spec.bed_mm)


@pytest.mark.parametrize(("typed", "kept"), [("5 %", "5%"), ("7.5%", "7.5%"), ("12", "12"), (12, "12"), ("0", "0")])
def test_spares_are_kept_as_they_are_meant(typed, kept):
    spec = KitSpec.parse({"spares": typed})
    assert spec.spares == kept
    assert KitSpec.parse(spec.model_dump(mode="json")) == spec


def test_every_field_has_help_and_a_group():
    for name, field in KitSpec.model_fields.items():
        assert field.description, name
        assert field.json_schema_extra["group"], name


def test_a_spec_survives_the_way_through_json():
    spec = KitSpec(faces=100, spacing=(1, 2, 3), seed=5)
    assert KitSpec.parse(spec.model_dump(mode="json")) == spec


@pytest.mark.parametrize(
    ("values", "method", "classes"),
    [
        ({}, "palette", 2),
        ({"method": "palette"}, "palette", 2),
        ({"classes": 5}, "palette", 5),
        ({"method": "pressure"}, "pressure", 7),
        ({"method": "pressure", "classes": 5}, "pressure", 5),
    ],
)
def test_the_method_implies_a_number_of_classes(values, method, classes):
    spec = KitSpec.parse(values)
    assert (spec.method, spec.classes) == (method, classes)
    assert KitSpec.parse(spec.model_dump(mode="json")) == spec


@given(st.integers(4, 10_000), st.floats(0.001, 50))
def test_the_tolerance_that_is_given_holds_for_every_mesh_and_method(faces, percent):
    for method in ("palette", "pressure"):
        assert KitSpec(method=method, tolerance_percent=percent).tolerance_for(faces) == percent


@given(st.integers(4, 10_000))
def test_the_tolerance_that_is_not_given_follows_from_method_and_faces(faces):
    found = KitSpec().tolerance_for(faces)
    assert found == (0.1 if faces <= MOST_WALKED_FACES else 1)
    assert found < KitSpec(method="pressure").tolerance_for(faces) == 1.5
    assert KitSpec(palette="universal").tolerance_for(faces) == found


def test_no_rounds_at_all_may_be_asked_for():
    assert KitSpec.parse({"rounds": 0}).rounds == 0


@pytest.mark.parametrize(
    ("values", "classes", "multisets"),
    [
        ({"palette": "30,35"}, 2, None),
        ({"palette": (30, 35), "classes": 4}, 4, None),
        ({"palette": "30,33,36"}, 10, None),
        ({"palette": [30, 33, 36], "classes": 6}, 6, None),
        ({"multisets": " SLL, lss,sll"}, 2, "ssl,sll"),
        ({"multisets": "lss", "palette": "universal"}, 1, "ssl"),
        ({"multisets": "cba,caa,bab"}, 3, "aac,abb,abc"),
    ],
)
def test_lengths_and_triangles_from_outside_choose_solver_and_classes(values, classes, multisets):
    spec = KitSpec.parse(values)
    assert (spec.method, spec.classes, spec.multisets) == ("palette", classes, multisets)
    assert KitSpec.parse(spec.model_dump(mode="json")) == spec


def test_a_kit_to_be_like_chooses_the_solver_but_tells_its_classes_later():
    spec = KitSpec.parse({"like": "kits/mito"})
    assert spec.method == "palette"
    assert "classes" not in spec.model_fields_set
    assert KitSpec.parse(spec.model_dump(mode="json", exclude_unset=True)) == spec


def test_given_lengths_are_bevelled_for_any_shape_unless_told_otherwise():
    assert KitSpec.parse({"palette": "universal"}).bevel_degrees == UNIVERSAL_BEVEL
    assert KitSpec.parse({"palette": "universal", "bevel_degrees": "30,45"}).bevel_degrees == (30, 45)
    assert KitSpec.parse({"palette": "universal", "thickening": "perpendicular"}).bevel_degrees is None
    assert KitSpec.parse({"multisets": "ssl"}).bevel_degrees is None
    assert KitSpec().bevel_degrees is None


def test_the_universal_pair_has_a_name_and_a_ratio_near_1_17():
    assert KitSpec.parse({"palette": " Universal "}).palette == drkid.UNIVERSAL == UNIVERSAL
    assert UNIVERSAL[1] / UNIVERSAL[0] == pytest.approx(1.17, abs=0.005)


@given(st.lists(st.sampled_from(["ssl", "sll", "sss", "lll", "lsl", "LLS"]), min_size=1))
def test_words_of_triangles_are_put_in_order_once(words):
    found = multiset_words(",".join(words))
    assert len(found) == len({"".join(sorted(word.lower())) for word in words})
    assert multiset_words(",".join(found)) == found
    assert all(word == "s" * word.count("s") + "l" * word.count("l") for word in found)


def test_processes_agree_with_their_own_rods():
    for preset in PROCESSES.values():
        assert list(preset.rods_mm) == sorted(preset.rods_mm)
        assert preset.rods_mm[-1] + 2 * preset.rod_clearance_mm >= preset.min_hole_mm
