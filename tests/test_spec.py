import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.errors import SpecError
from drkid.spec import PROCESSES, KitSpec


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"faces": 3}, ["faces", "greater than or equal to 4", "3"]),
        ({"faces": 173}, ["173", "even"]),
        ({"faces": 8, "classes": 9}, ["classes is 9", "8 faces"]),
        ({"faces": 8, "vertices": 6}, ["both given"]),
        ({"thickness_mm": -1}, ["thickness_mm", "greater than 0", "-1"]),
        ({"tolerance_percent": float("nan")}, ["tolerance_percent", "nan"]),
        ({"knuckles": 3}, ["knuckles is 3", "even"]),
        ({"process": "wood"}, ["process", "'fdm'", "wood"]),
        ({"spacing": "1,2"}, ["spacing"]),
        ({"spacing": "1,2,0"}, ["spacing", "greater than 0"]),
        ({"colour": 1}, ["no parameter colour"]),
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


def test_every_field_has_help_and_a_group():
    for name, field in KitSpec.model_fields.items():
        assert field.description, name
        assert field.json_schema_extra["group"], name


def test_a_spec_survives_the_way_through_json():
    spec = KitSpec(faces=100, spacing=(1, 2, 3), seed=5)
    assert KitSpec.parse(spec.model_dump(mode="json")) == spec


def test_processes_agree_with_their_own_rods():
    for preset in PROCESSES.values():
        assert list(preset.rods_mm) == sorted(preset.rods_mm)
        assert preset.rods_mm[-1] + 2 * preset.rod_clearance_mm >= preset.min_hole_mm
