import numpy as np
import pytest
from exact_shapes import decomposed, geodesic, icosahedron, potato

from drkid.measure import bend_radians
from drkid.parts.bevel import bisector_insets, demanded
from drkid.parts.groove import groove_mm, recesses, touching_mm
from drkid.parts.members import members_of

T = 6.0


def test_exact_bisectors_leave_no_groove_and_do_not_touch() -> None:
    d = decomposed(icosahedron())
    members = members_of(d)
    insets = bisector_insets(demanded(members, 30.0, T, 0.0), members, d.class_lengths)
    recess = recesses(members, insets, 30.0, T)
    assert groove_mm(d.mesh, members, recess) == pytest.approx(np.zeros(30), abs=1e-4)
    assert touching_mm(d.mesh, members, recess, 30.0) == pytest.approx(np.zeros(30), abs=1e-4)


def test_groove_is_the_stated_formula() -> None:
    d = decomposed(geodesic())
    members = members_of(d)
    insets = bisector_insets(demanded(members, 30.0, T, 5.5), members, d.class_lengths)
    found = groove_mm(d.mesh, members, recesses(members, insets, 30.0, T))
    bend = bend_radians(d.mesh)
    middle, slope = insets.mean(axis=1), (insets[:, 0] - insets[:, 1]) / T
    for edge, faces in enumerate(d.mesh.edge_faces):
        sides = []
        for face in faces:
            own = np.flatnonzero(d.mesh.face_edges[face] == edge)[0]
            rank = np.flatnonzero(members.face_side[face] == own)[0]
            sides.append((middle[d.face_class[face], rank], slope[d.face_class[face], rank]))
        (sigma_a, tan_a), (sigma_b, tan_b) = sides
        wide = sigma_a + sigma_b + T * abs(np.tan(bend[edge] / 2) - (tan_a + tan_b) / 2)
        assert found[edge] == pytest.approx(wide * np.cos(bend[edge] / 2), abs=1e-4)


@pytest.mark.parametrize("seed", range(4))
def test_straight_sides_touch_wherever_the_surface_bends(seed) -> None:
    d = decomposed(potato(seed), 80)  # every face its own class: congruent
    members = members_of(d)
    recess = recesses(members, np.zeros((80, 2, 3)), 30.0, T)
    deep = T * np.abs(np.tan(bend_radians(d.mesh) / 2))
    assert touching_mm(d.mesh, members, recess, 30.0) == pytest.approx(deep, abs=1e-6)
    assert groove_mm(d.mesh, members, recess) == pytest.approx(deep * np.cos(bend_radians(d.mesh) / 2), abs=1e-6)
