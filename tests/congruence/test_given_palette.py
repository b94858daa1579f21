import numpy as np
import pytest
import trimesh

from drkid.congruence import decompose
from drkid.congruence.given_palette import palette_of
from drkid.congruence.palette import all_multisets, palette_of_classes
from drkid.congruence.palette_solver import first_frame
from drkid.errors import SpecError
from drkid.mesh import TriMesh
from drkid.spec import KitSpec

RNG = np.random.default_rng(0)


def test_without_lengths_or_triangles_the_classes_decide(pebble):
    assert palette_of(KitSpec(method="palette", classes=3), pebble, RNG) == palette_of_classes(3)


def test_given_lengths_fix_the_ratios_and_leave_the_triangles_to_the_classes(pebble):
    palette = palette_of(KitSpec(palette=(30, 36), classes=4), pebble, RNG)
    assert palette.ratios == (1, 1.2)
    assert palette.multisets == palette_of_classes(4).multisets
    assert palette.held
    assert not palette_of_classes(4).held


def test_given_triangles_are_taken_whatever_the_lengths(pebble):
    free = palette_of(KitSpec(multisets="sss,lls"), pebble, RNG)
    fixed = palette_of(KitSpec(multisets="sss,lls", palette=(40, 50)), pebble, RNG)
    assert free.multisets == fixed.multisets == ((0, 0, 0), (0, 1, 1))
    assert (free.held, fixed.held) == (False, True)
    assert fixed.ratios == (1, 1.25)


def test_three_lengths_make_all_ten_triangles_or_the_best_of_them(pebble):
    lengths = (30.0, 33.0, 37.0)
    every = palette_of(KitSpec(palette=lengths), pebble, RNG)
    some = palette_of(KitSpec(palette=lengths, classes=9), pebble, RNG)
    assert every.multisets == all_multisets(3)
    assert len(some.multisets) == 9
    assert some.ratios == every.ratios == tuple(x / 30 for x in lengths)


def test_a_large_mesh_is_not_searched(pebble):
    lengths = (30.0, 33.0, 37.0)
    with pytest.raises(SpecError, match="9 classes of three lengths") as caught:
        palette_of(KitSpec(palette=lengths, classes=9), pebble, RNG, large=True)
    assert "--multisets" in caught.value.remedy
    assert len(palette_of(KitSpec(palette=lengths), pebble, RNG, large=True).multisets) == 10
    assert palette_of(KitSpec(palette=lengths, multisets="aab,bcc"), pebble, RNG, large=True).held


@pytest.mark.parametrize("number", range(4))
def test_no_start_changes_held_ratios(pebble, number):
    palette = palette_of(KitSpec(palette=(30, 36)), pebble, RNG)
    frame = first_frame(pebble, palette, number, RNG)
    assert frame.lengths[1] / frame.lengths[0] == pytest.approx(1.2, rel=1e-12)


@pytest.mark.parametrize(("palette", "multisets"), [((30.0, 35.1), "ssl,sll"), ((31.0, 34.0, 37.5), "aab,abb,bbc,bcc")])
def test_printed_edges_have_the_given_lengths_exactly(pebble, palette, multisets):
    found = decompose(pebble, KitSpec(palette=palette, multisets=multisets, rounds=2))
    printed = np.unique((found.class_lengths * found.scale_mm_per_unit).round(9))
    assert set(printed) <= set(palette)
    assert len(printed) > 1
    if found.outcome.message.startswith("exact"):
        edges = found.mesh.edge_lengths * found.scale_mm_per_unit
        assert np.abs(edges[:, None] - palette).min(axis=1).max() < 1e-6


def test_the_pair_of_lengths_makes_an_exact_mesh(pebble):
    found = decompose(pebble, KitSpec(palette="universal", rounds=4))
    assert "exact" in found.outcome.message
    assert found.face_errors.max() < 1e-9 * pebble.mean_edge


def test_the_scale_follows_the_mesh_and_the_lengths(pebble):
    spec = KitSpec(palette=(30, 36), rounds=1)
    scale = decompose(pebble, spec).scale_mm_per_unit
    longer = decompose(pebble, spec.model_copy(update={"palette": (60.0, 72.0)}))
    larger = decompose(pebble.scaled(10), spec)
    assert longer.scale_mm_per_unit == pytest.approx(2 * scale, rel=1e-9)
    assert larger.scale_mm_per_unit == pytest.approx(scale / 10, rel=1e-3)


@pytest.mark.parametrize("method", ["palette", "pressure"])
def test_without_given_lengths_the_scale_is_open(pebble, method):
    spec = KitSpec(method=method, classes=2, rounds=1, tolerance_percent=30)
    assert decompose(pebble, spec).scale_mm_per_unit is None


def test_handles_hold_the_ratio_too():
    torus = trimesh.creation.torus(2.0, 0.9, major_sections=12, minor_sections=6)
    mesh = TriMesh(np.asarray(torus.vertices), np.asarray(torus.faces))
    found = decompose(mesh, KitSpec(palette=(30, 35.1), rounds=1))
    assert found.mesh.genus == 1
    assert set(np.unique((found.class_lengths * found.scale_mm_per_unit).round(9))) == {30, 35.1}
