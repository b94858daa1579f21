from dataclasses import replace

import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato, sixths, tetrahedron
from hypothesis import given, settings
from hypothesis import strategies as st

from drkid.errors import FitError
from drkid.export.stl import stl_bytes
from drkid.kit import Decomposition, PartSet, class_id
from drkid.measure import bend_radians
from drkid.mesh import TriMesh, rounded
from drkid.parts import make_parts
from drkid.parts.pocket import pocket
from drkid.spec import PROCESSES, KitSpec

KITS = {"icosahedron": icosahedron(), "geodesic": geodesic(), "sixths": sixths()}


def made(mesh: TriMesh, classes: int | None = None, **spec: object) -> PartSet:
    return make_parts(decomposed(mesh, classes), KitSpec(**spec))


def side_lengths(corners) -> np.ndarray:
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


@pytest.fixture(scope="module", params=KITS)
def kit(request) -> tuple[Decomposition, PartSet]:
    d = decomposed(KITS[request.param])
    return d, make_parts(d, KitSpec())


def test_parts_have_the_lengths_of_their_class_and_fit_their_faces(kit) -> None:
    d, parts = kit
    for part in parts.parts:
        lengths = d.class_lengths[part.class_index] * parts.scale_mm_per_unit
        assert np.sort(side_lengths(part.corners)) == pytest.approx(lengths)
        assert part.corners.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
        order = side_lengths(part.corners)
        assert order[0] == pytest.approx(lengths[0])
        if part.handedness != "any":
            assert (order[1] < order[2]) == (part.handedness == "right")
    turned = (np.arange(3) + parts.face_turn[:, None]) % 3
    of_faces = np.take_along_axis(d.mesh.side_lengths, turned, 1) * parts.scale_mm_per_unit
    of_parts = np.array([side_lengths(parts.parts[p].corners) for p in parts.face_part])
    assert of_faces == pytest.approx(of_parts, abs=1e-4)


def test_pieces_are_solid_and_as_thick_as_stated(kit) -> None:
    _, parts = kit
    for part in parts.parts:
        mesh = part.solid.mesh()
        assert mesh.is_closed_manifold
        assert mesh.component_count == 1
        assert mesh.volume > 0
        half = parts.dimensions.thickness_mm / 2
        assert part.solid.bounds[:, 2] == pytest.approx([-half, half])


def test_all_pockets_hold_the_connector_alike_with_the_clearance(kit) -> None:
    _, parts = kit
    half = parts.connectors[0].solid
    for part in parts.parts:
        for frame in part.side_frames:
            held = half.moved(frame)
            assert (held & part.solid).volume < 1e-9
            assert part.solid.gap(held, 1.0) == pytest.approx(parts.dimensions.clearance_mm, abs=1e-6)
            assert (pocket(parts.dimensions).moved(frame) & part.solid).volume < 1e-9


def test_left_is_the_mirror_image_of_right() -> None:
    right, left = made(sixths(), marks=False).parts
    assert (right.handedness, left.handedness) == ("right", "left")
    mirrored = right.solid.moved(np.diag([-1.0, 1, 1, 1]))
    assert (mirrored & left.solid).volume == pytest.approx(left.solid.volume)
    assert left.solid.volume == pytest.approx(right.solid.volume)


@pytest.mark.parametrize("thickening", ["bisector", "flippable", "mean_normal", "perpendicular"])
def test_symmetric_pieces_are_their_own_mirror_image(thickening) -> None:
    for part in made(geodesic(), thickening=thickening, marks=False).parts:
        assert part.handedness == "any"
        lengths = side_lengths(part.corners)
        odd = int(np.argmax(np.abs(lengths - np.median(lengths))))  # the base of the isosceles piece
        x, y = np.roll(part.corners, -1, axis=0)[odd, :2] - part.corners[odd, :2]
        mirror = np.eye(4)
        mirror[:2, :2] = np.eye(2) - 2 * np.outer([x, y], [x, y]) / (x * x + y * y)
        assert (part.solid & part.solid.moved(mirror)).volume == pytest.approx(part.solid.volume, rel=1e-5)


def test_a_kit_without_left_faces_has_no_left_part() -> None:
    d = decomposed(sixths())
    parts = make_parts(d, KitSpec())
    assert np.bincount(parts.face_part).tolist() == [24, 24]
    # one class for the right-handed faces alone, one for the left-handed ones
    own = parts.face_part.copy()
    apart = Decomposition(d.mesh, own, np.repeat(d.class_lengths, 2, axis=0), d.face_errors, 0, (), d.outcome)
    assert [(p.class_index, p.handedness) for p in make_parts(apart, KitSpec()).parts] == [(0, "right"), (1, "left")]


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("connector", ["hinge", "snap", "box", "none"])
def test_every_process_and_connector_makes_a_kit_that_fits(process, connector) -> None:
    parts = made(geodesic(), process=process, connector=connector)
    size = parts.scale_mm_per_unit * geodesic().extents.max()
    assert size == pytest.approx(round(size))
    assert [c.name for c in parts.connectors] == {
        "hinge": ["connector_half"],
        "snap": ["connector_snap"],
        "box": ["connector_key"],
        "none": [],
    }[connector]
    assert all(p.solid.mesh().is_closed_manifold for p in parts.parts)
    if connector != "none":
        with pytest.raises(FitError):
            made(geodesic(), process=process, connector=connector, size_mm=round(size) - 2.0)


# published smallest mean edge of a flat equilateral piece per process, mm; a bevelled one needs a little more
SMALLEST_EDGE = {"fdm": 31.6, "sla": 22.9, "polyjet": 22.9, "injection": 22.3}


@pytest.mark.parametrize("process", PROCESSES)
def test_smallest_size_is_close_to_the_published_one(process) -> None:
    mesh = icosahedron()
    edge = made(mesh, process=process).scale_mm_per_unit * mesh.mean_edge
    assert SMALLEST_EDGE[process] - 0.5 < edge < SMALLEST_EDGE[process] + 1.5


def test_too_small_is_refused_with_class_numbers_and_remedies() -> None:
    smallest = made(geodesic()).scale_mm_per_unit * geodesic().extents.max()
    with pytest.raises(FitError) as caught:
        made(geodesic(), size_mm=70)
    error = caught.value
    assert "class A" in error.problem or "class B" in error.problem
    assert "wall between two pockets" in error.problem
    assert error.wanted == "1.20 mm"
    assert float(error.found.split()[0]) < 1.2
    assert f"--size-mm {smallest:.0f}" in error.remedy
    assert "fewer pieces" in error.remedy
    assert "thinner rod" in error.remedy


def test_a_proposed_size_fits_when_it_is_given() -> None:
    proposed = made(geodesic())
    size = float(geodesic().scaled(proposed.scale_mm_per_unit).extents.max())
    again = made(geodesic(), size_mm=size, thickness_mm=proposed.dimensions.thickness_mm)
    assert again.scale_mm_per_unit == pytest.approx(proposed.scale_mm_per_unit)
    assert again.dimensions == proposed.dimensions


def test_a_piece_larger_than_the_bed_is_refused() -> None:
    with pytest.raises(FitError, match="larger than the printer's bed") as caught:
        made(icosahedron(), size_mm=500)
    assert "220" in caught.value.wanted


def test_a_scale_that_the_lengths_fix_is_kept_whatever_the_size() -> None:
    d = replace(decomposed(geodesic()), scale_mm_per_unit=123.456)
    parts = make_parts(d, KitSpec(size_mm=50))
    assert parts.scale_mm_per_unit == 123.456
    assert side_lengths(parts.parts[0].corners) == pytest.approx(d.class_lengths[0] * 123.456, abs=1e-9)


def test_lengths_too_short_for_the_connector_are_refused_with_those_that_do() -> None:
    d = decomposed(geodesic())
    with pytest.raises(FitError, match="wall between two pockets") as caught:
        make_parts(replace(d, scale_mm_per_unit=30.0), KitSpec())
    error = caught.value
    assert float(error.found.split()[0]) < float(error.wanted.split()[0])
    longer = min(float(word) for word in error.remedy.split("--palette ")[1].split(")")[0].split(","))
    fitting = longer / d.class_lengths.min()
    assert make_parts(replace(d, scale_mm_per_unit=fitting), KitSpec()).scale_mm_per_unit == fitting
    assert make_parts(replace(d, scale_mm_per_unit=30.0), KitSpec(connector="none")).scale_mm_per_unit == 30


def dented() -> TriMesh:
    """The geodesic sphere with one five-valent vertex mirrored in the plane of its neighbours: the same lengths."""
    sphere = geodesic()
    vertex = int(np.flatnonzero(sphere.valence == 5)[0])
    around = np.unique(sphere.edges[(sphere.edges == vertex).any(axis=1)])
    middle = sphere.vertices[around[around != vertex]].mean(axis=0)
    vertices = sphere.vertices.copy()
    vertices[vertex] = 2 * middle - vertices[vertex]
    return sphere.moved(vertices)


@pytest.mark.parametrize("connector", ["hinge", "box"])
def test_a_bevel_for_any_shape_makes_the_same_files_whatever_the_joints(connector) -> None:
    def files(mesh: TriMesh) -> dict[str, bytes]:
        spec = KitSpec(connector=connector, bevel_degrees=(60, 90))
        made = make_parts(replace(decomposed(mesh), scale_mm_per_unit=60.0), spec)
        solids = [(f"class {part.class_index}", part.solid) for part in made.parts]
        solids += [(one.name, one.solid) for one in made.connectors]
        return {name: stl_bytes(rounded(solid.mesh())) for name, solid in solids}

    bends = [np.degrees(bend_radians(mesh)) for mesh in (geodesic(), dented())]
    assert bends[0].min() > 10
    assert bends[1].min() < -10
    one, other = files(geodesic()), files(dented())
    assert one == other
    assert len(one) == 3


def test_a_bevel_for_any_shape_costs_a_groove_and_the_notes_say_so() -> None:
    own, wide = made(icosahedron()), made(icosahedron(), bevel_degrees=(30, 60))
    assert own.groove_mm.mean() < wide.groove_mm.mean() / 2
    assert wide.groove_choices[0].mean_mm == pytest.approx(own.groove_mm.mean(), rel=0.1)
    note = wide.notes[-1]
    assert f"grooves are {wide.groove_mm.mean():.1f} mm wide" in note
    assert f"make them {wide.groove_choices[0].mean_mm:.1f}" in note


def test_a_joint_beyond_the_given_bends_is_refused_with_its_place_and_angle() -> None:
    with pytest.raises(FitError, match=r"bends by 41\.8° \(convex\)") as caught:
        made(icosahedron(), bevel_degrees=(10, 40))
    error = caught.value
    assert "29 more joints" in error.problem
    assert "40° convex" in error.wanted
    assert "--bevel-degrees 10,42" in error.remedy
    x, y, z = (float(word) for word in error.problem.split("(")[1].split(")")[0].split(","))
    mesh = icosahedron().scaled(made(icosahedron(), bevel_degrees=(10, 42)).scale_mm_per_unit)
    middles = mesh.vertices[mesh.edges].mean(axis=1)
    assert np.linalg.norm(middles - [x, y, z], axis=1).min() < 3  # the size is another
    with pytest.raises(FitError, match="concave"):
        made(dented(), bevel_degrees=(10, 60), size_mm=150)


@pytest.mark.parametrize("count", [1, 2])
def test_variants_are_classes_of_their_own_and_narrow_the_grooves(count) -> None:
    d = decomposed(potato(3), 4)
    one, made = make_parts(d, KitSpec(size_mm=200)), make_parts(d, KitSpec(size_mm=200, bevel_variants=count))
    assert [part.class_index for part in made.parts] == sorted(part.class_index for part in made.parts)
    assert {part.name[1:] for part in made.parts} == ({""} if count == 1 else {"1", "2"})
    assert made.groove_mm.mean() <= one.groove_mm.mean()
    chosen = made.groove_choices[count - 1]
    assert (chosen.bevel_variants, chosen.moulds) == (count, len(made.parts))
    assert chosen.mean_mm == pytest.approx(made.groove_mm.mean())
    assert chosen.max_mm == pytest.approx(made.groove_mm.max())
    split = made.by_parts(d)
    assert len(split.class_lengths) == count * len(d.class_lengths)
    assert (split.class_lengths[split.face_class] == d.class_lengths[d.face_class]).all()
    assert (split.face_class == np.array([p.class_index for p in made.parts])[made.face_part]).all()
    assert [part.name[0] for part in made.parts] == [class_id(made.split_class[p.class_index] if made.split_class
                                                              else p.class_index) for p in made.parts]  # fmt: skip


def test_scale_of_the_source_does_not_matter_at_a_fixed_size() -> None:
    one, other = made(geodesic(), size_mm=150), made(geodesic().scaled(1e-3), size_mm=150)
    assert other.scale_mm_per_unit == pytest.approx(1e3 * one.scale_mm_per_unit)
    assert other.groove_mm == pytest.approx(one.groove_mm, abs=1e-6)
    for a, b in zip(one.parts, other.parts, strict=True):
        assert b.corners == pytest.approx(a.corners, abs=1e-6)
        assert b.solid.volume == pytest.approx(a.solid.volume)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 1000))
def test_relabelled_faces_are_made_from_the_same_parts(seed) -> None:
    d = decomposed(sixths())
    order = np.random.default_rng(seed).permutation(len(d.face_class))
    mesh = TriMesh(d.mesh.vertices, d.mesh.faces[order])
    again = Decomposition(mesh, d.face_class[order], d.class_lengths, d.face_errors[order], 0, (), d.outcome)
    one, other = make_parts(d, KitSpec()), make_parts(again, KitSpec())
    assert (other.face_part == one.face_part[order]).all()
    assert (other.face_turn == one.face_turn[order]).all()
    assert [p.solid.volume for p in other.parts] == pytest.approx([p.solid.volume for p in one.parts])


def test_unlike_faces_make_left_and_right_parts_and_larger_grooves() -> None:
    exact, rough = (made(potato(3), k, size_mm=200, marks=False, connector="none") for k in (80, 5))
    assert len(exact.parts) == 80
    assert len(rough.parts) == 10
    assert rough.groove_mm.mean() > 2 * exact.groove_mm.mean()


def test_notes_tell_how_pockets_are_used() -> None:
    assert "pressed in from inside" in made(icosahedron()).notes[0]
    assert made(icosahedron(), connector="none", marks=False).notes == ()


def test_notes_tell_that_keys_are_glued() -> None:
    note = made(icosahedron(), connector="box").notes[0]
    assert "glued" in note
    assert "0 joints bend more" in note


def test_notes_count_the_joints_that_touch() -> None:
    notes = " ".join(made(icosahedron(), thickening="perpendicular").notes)
    assert "30 of 30 joints" in notes
    assert "reach into one another" not in " ".join(made(icosahedron()).notes)


def test_notes_tell_which_sides_lack_their_bevel() -> None:
    flat = tetrahedron()
    steep = decomposed(flat.moved(flat.vertices * [1, 1, 0.5]))
    text = " ".join(make_parts(steep, KitSpec(connector="box")).notes)  # a key does not grow with the bend
    assert "Class A, side 1" in text
    assert "sides lack" in text
    assert "sides lack" not in " ".join(make_parts(steep, KitSpec()).notes)


def test_notes_tell_of_joints_sharper_than_any_hinge() -> None:
    flat = tetrahedron()
    mesh = flat.moved(flat.vertices * [1, 1, 0.25])
    text = " ".join(make_parts(decomposed(mesh), KitSpec(connector="none")).notes)
    sharp = (np.abs(np.degrees(bend_radians(mesh))) > 140 - 5.5).sum()
    assert 0 < sharp < 6
    assert f"{sharp} joints bend by more than 134.5°" in text


def test_findings_name_what_a_process_cannot_make() -> None:
    parts = made(icosahedron(), process="injection")
    failed = {f.what: f for f in parts.findings if not f.is_met}
    assert failed["thickness"].needed == 3.5
    assert failed["thickness"].available == parts.dimensions.thickness_mm
    assert "core them out" in str(failed["thickness"])
    walls = [f for f in parts.findings if f.what == "wall between two pockets"]
    assert walls
    assert all(f.is_met and f.subject == "class A" for f in walls)
    assert all(f.is_met for f in made(icosahedron()).findings)


def test_a_mean_edge_sets_the_scale() -> None:
    mesh = geodesic()
    parts = made(mesh, mean_edge_mm=60)
    assert parts.scale_mm_per_unit * mesh.mean_edge == pytest.approx(60)
    assert parts.dimensions.knuckles > 2
    assert made(mesh, fit=True).scale_mm_per_unit == made(mesh).scale_mm_per_unit


def test_a_process_without_marks_makes_flat_pieces_without_a_word_of_curved_ones() -> None:
    smooth = PROCESSES["fdm"].model_copy(update={"mark_depth_mm": 0.0})
    assert not [note for note in made(icosahedron(), process_values=smooth).notes if "marks" in note]


def test_marks_take_material_and_change_no_mould() -> None:
    plain, engraved = (made(sixths(), marks=on) for on in (False, True))
    assert len(plain.parts) == len(engraved.parts)
    for a, b in zip(plain.parts, engraved.parts, strict=True):
        assert b.solid.volume < a.solid.volume
        assert (b.solid - a.solid).volume < 1e-6


def test_progress_runs_from_nothing_to_all() -> None:
    told: list[float] = []
    make_parts(decomposed(icosahedron()), KitSpec(), lambda _, fraction: told.append(fraction))
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0.0, 1.0)
