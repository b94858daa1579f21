import numpy as np
import pytest
from quadratic_problem import pebble, small_ring

from drkid.congruence import labelling
from drkid.congruence.labelling import nearest_labels, repaired
from drkid.congruence.palette import palette_of_classes, parse_multisets

LENGTHS = np.array([0.9, 1.0, 1.13])


def lengths_of(palette):
    return np.array(palette.ratios) / np.mean(palette.ratios)


@pytest.mark.parametrize("name", ["potato", "ring"])
def test_no_length_is_nearer_than_that_of_the_label(name, request):
    mesh = request.getfixturevalue(name)
    lengths = LENGTHS * mesh.mean_edge
    labels = nearest_labels(mesh, lengths)
    chosen = np.abs(mesh.edge_lengths - lengths[labels])
    for length in lengths:
        assert (chosen <= np.abs(mesh.edge_lengths - length)).all()
    assert labels.dtype == np.int64


def test_nearest_labels_do_not_depend_on_place_and_unit(potato):
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    lengths = LENGTHS * potato.mean_edge
    moved = potato.moved(40 * potato.vertices @ turn + 7)
    np.testing.assert_array_equal(nearest_labels(moved, 40 * lengths), nearest_labels(potato, lengths))


@pytest.mark.parametrize("name", ["potato", "ring"])
@pytest.mark.parametrize("classes", [2, 3, 4, 10])
def test_every_face_is_allowed_after_repair(name, classes, request):
    mesh, palette = request.getfixturevalue(name), palette_of_classes(classes)
    lengths = lengths_of(palette) * mesh.mean_edge
    first = nearest_labels(mesh, lengths)
    given = first.copy()
    labels = repaired(mesh, first, palette, lengths, np.random.default_rng(0))
    assert labels is not None
    assert palette.allowed[tuple(labels[mesh.face_edges].T)].all()
    np.testing.assert_array_equal(first, given)


def test_what_is_allowed_already_stays(potato):
    palette = palette_of_classes(10)
    labels = nearest_labels(potato, LENGTHS * potato.mean_edge)
    kept = repaired(potato, labels, palette, LENGTHS, np.random.default_rng(0))
    np.testing.assert_array_equal(kept, labels)


def test_repair_stays_nearer_than_chance(potato):
    palette = palette_of_classes(2)
    lengths = lengths_of(palette) * potato.mean_edge
    first = nearest_labels(potato, lengths)
    assert not palette.allowed[tuple(first[potato.face_edges].T)].all()
    labels = repaired(potato, first, palette, lengths, np.random.default_rng(0))
    by_chance = np.random.default_rng(0).permutation(labels)

    def misfit(some):
        return ((potato.edge_lengths - lengths[some]) ** 2).sum()

    assert misfit(first) <= misfit(labels) < 0.8 * misfit(by_chance)


def test_the_same_seed_repairs_the_same():
    mesh, palette = small_ring(), palette_of_classes(2)
    first = np.zeros(len(mesh.edges), np.int64)
    one, two, other = (
        repaired(mesh, first, palette, lengths_of(palette), np.random.default_rng(seed)) for seed in (4, 4, 5)
    )
    np.testing.assert_array_equal(one, two)
    assert (one != other).any()


def test_one_long_edge_in_each_face_is_found_on_a_small_ring():
    mesh, palette = small_ring(), palette_of_classes(1)
    first = nearest_labels(mesh, lengths_of(palette))
    labels = repaired(mesh, first, palette, lengths_of(palette), np.random.default_rng(0))
    assert labels is not None
    assert (labels[mesh.face_edges].sum(axis=1) == 1).all()


def test_nothing_is_returned_where_the_search_ends_without_success(monkeypatch):
    mesh, palette = pebble(), parse_multisets("abc")
    monkeypatch.setattr(labelling, "SWEEPS", 2)
    first = np.zeros(len(mesh.edges), np.int64)
    assert repaired(mesh, first, palette, LENGTHS, np.random.default_rng(0)) is None
