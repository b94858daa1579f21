import numpy as np
import pytest
import trimesh

from drkid.congruence import decompose, palette_solver
from drkid.congruence.palette_solver import PaletteSolver
from drkid.congruence.solver import run
from drkid.errors import SpecError
from drkid.intersection import self_intersections
from drkid.mesh import TriMesh
from drkid.spec import KitSpec

TWO = KitSpec(method="palette", classes=2, rounds=4, tolerance_percent=0.001)


@pytest.fixture(scope="module")
def solved(pebble):
    return decompose(pebble, TWO)


def test_two_classes_are_exact_to_machine_precision(pebble, solved):
    assert solved.outcome.status == "converged"
    assert "exact" in solved.outcome.message
    assert solved.face_errors.max() < 1e-9 * pebble.mean_edge
    assert len(solved.class_lengths) == 2
    assert len(solved.mesh.faces) == len(pebble.faces)


def test_both_classes_are_isosceles_of_the_same_two_lengths(solved):
    lengths = np.unique(solved.class_lengths.round(12))
    assert len(lengths) == 2
    for triple in solved.class_lengths:
        assert len(np.unique(triple.round(12))) == 2


def test_the_mesh_is_sound(pebble, solved):
    assert solved.mesh.is_closed_manifold
    assert solved.mesh.genus == 0
    assert solved.mesh.volume == pytest.approx(pebble.volume, rel=0.2)
    assert len(self_intersections(solved.mesh)) == 0


def test_rounds_and_seed_decide_everything(pebble, solved):
    again = decompose(pebble, TWO)
    assert (again.mesh.vertices == solved.mesh.vertices).all()
    assert (again.mesh.faces == solved.mesh.faces).all()


def test_size_does_not_matter(pebble, solved):
    large = decompose(pebble.scaled(1000), TWO)
    assert large.mesh.vertices == pytest.approx(1000 * solved.mesh.vertices, rel=1e-4, abs=1)
    assert large.face_errors.max() < 1e-6 * pebble.mean_edge


def test_the_best_never_gets_worse_from_round_to_round(pebble):
    solver = PaletteSolver(TWO, pebble)
    state = solver.init(pebble)
    for _ in range(3):
        before = state.found.rank
        state = solver.step(state)
        assert state.found.rank <= before
    assert state.round == 3
    assert "d_H" in solver.told(state)


def test_an_interruption_keeps_the_best_so_far(pebble, monkeypatch):
    step = PaletteSolver.step

    def impatient(self, state):
        if state.round == 1:
            raise KeyboardInterrupt
        return step(self, state)

    monkeypatch.setattr(PaletteSolver, "step", impatient)
    solution = run(PaletteSolver(TWO, pebble), pebble, lambda *_: None)
    assert "ended by hand" in solution.outcome.message
    assert solution.iterations == 1
    assert solution.best.mesh.is_closed_manifold


def test_time_ends_the_search(pebble):
    solver = PaletteSolver(KitSpec(method="palette", classes=2, seconds=0.01), pebble)
    assert solver.finished(solver.init(pebble)) is not None


def test_a_surface_with_a_handle_is_solved_as_far_as_it_goes():
    """Genus 1 asks for six lengths more than there are freedoms: the scale is held and the residual made small."""
    torus = trimesh.creation.torus(2.0, 0.9, major_sections=13, minor_sections=7)
    ring = TriMesh(np.asarray(torus.vertices), np.asarray(torus.faces))
    found = decompose(ring, KitSpec(method="palette", classes=4, rounds=2, tolerance_percent=5))
    assert found.mesh.genus == 1
    assert isinstance(found.mesh, TriMesh)
    assert found.mesh.mean_edge == pytest.approx(ring.mean_edge, rel=0.1)
    assert "genus 1 has 6 lengths more than freedoms" in found.outcome.message
    assert 100 * found.face_errors.max() / found.mesh.mean_edge < 10


@pytest.mark.parametrize("classes", [1, 6])
def test_other_numbers_of_classes(pebble, classes):
    found = decompose(pebble, KitSpec(method="palette", classes=classes, rounds=3, tolerance_percent=5))
    assert len(found.class_lengths) <= classes
    assert len(np.unique(found.class_lengths.round(9))) <= 3
    assert found.mesh.is_closed_manifold
    assert 100 * found.face_errors.max() / found.mesh.mean_edge < 5


def test_a_large_mesh_is_annealed_by_patches_and_kept_within_the_tolerance(pebble, monkeypatch):
    monkeypatch.setattr(palette_solver, "MOST_WALKED_FACES", 60)
    found = decompose(pebble, KitSpec(method="palette", classes=4, rounds=0, tolerance_percent=5))
    assert found.iterations == palette_solver.ROUNDS  # the start is always finished
    assert found.mesh.is_closed_manifold
    assert len(found.mesh.faces) == len(pebble.faces)
    assert found.outcome.status == "converged"
    assert 100 * found.face_errors.max() / found.mesh.mean_edge < 5


def test_hops_on_a_large_mesh_never_make_it_worse(pebble, monkeypatch):
    monkeypatch.setattr(palette_solver, "MOST_WALKED_FACES", 60)
    solver = PaletteSolver(KitSpec(method="palette", classes=10, rounds=9, tolerance_percent=5), pebble)
    state = solver.init(pebble)
    ranks = []
    while solver.finished(state) is None:
        state = solver.step(state)
        ranks.append(state.found.rank)
    assert len(ranks) == 9
    assert ranks[palette_solver.ROUNDS - 1 :] == sorted(ranks[palette_solver.ROUNDS - 1 :], reverse=True)


def test_the_first_starts_are_an_answer_and_the_others_the_first_round(pebble, monkeypatch):
    solver = PaletteSolver(KitSpec(method="palette", classes=2, rounds=1), pebble)
    first = solver.init(pebble)
    assert len(first.walks) == palette_solver.FIRST_STARTS
    assert first.best.percent < 10
    assert solver.finished(first) is None
    second = solver.step(first)
    assert len(second.walks) == palette_solver.WALKS
    assert [walk.found.rank for walk in second.walks] == sorted(walk.found.rank for walk in second.walks)
    assert second.found.rank <= first.found.rank
    monkeypatch.setattr(palette_solver, "MANY_FACES", 60)
    assert len(solver.step(first).walks) == palette_solver.FEW_WALKS


def test_what_starts_leave_is_made_exact_by_repairing_folds(pebble, monkeypatch):
    monkeypatch.setattr(palette_solver, "MANY_FACES", 60)
    solver = PaletteSolver(KitSpec(method="palette", classes=4, rounds=24), pebble)
    state = solver.init(pebble)
    assert all(walk.descent is not None for walk in state.walks)
    while solver.finished(state) is None:
        state = solver.step(state)
    assert state.found.exact


def test_time_grows_with_the_faces_from_ten_seconds():
    seconds = [palette_solver.default_seconds(faces) for faces in (40, 172, 250, 500, 2000, 5000)]
    assert seconds[0] == seconds[1] == 10
    assert seconds[3:] == [60, 60, 150]
    assert seconds == sorted(seconds)


def test_more_classes_than_palettes_have_are_refused(pebble):
    with pytest.raises(SpecError, match="11 classes"):
        decompose(pebble, KitSpec(method="palette", classes=11))
