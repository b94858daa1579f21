import numpy as np
import pytest
from quadratic_problem import dense_problem, pebble, room, small_ring

from drkid.congruence.alternating_cycle import LONGEST_CYCLE, cycle_share, propose_cycle
from drkid.congruence.annealing import Schedule, anneal
from drkid.congruence.labelling import first_labels
from drkid.congruence.palette import palette_of_classes, parse_multisets
from drkid.congruence.quadratic_model import connectivity

PROPOSALS = 600


class Walks:
    """A labelled mesh and the cycles (edges, their new labels) of many walks on it."""

    def __init__(self, mesh, words, free=None, seed=0):
        self.mesh, self.palette, rng = mesh, parse_multisets(words), np.random.default_rng(seed)
        self.lengths = np.array(self.palette.ratios) / np.mean(self.palette.ratios)
        self.labels = first_labels(mesh, self.palette, self.lengths, rng)
        self.free = np.ones(len(self.labels), np.bool_) if free is None else free
        net, problem = connectivity(mesh), dense_problem(mesh)
        move = room(problem.model(mesh.edges, self.lengths[self.labels]))
        move = move._replace(edge=np.empty(LONGEST_CYCLE, np.int64), label=np.empty(LONGEST_CYCLE, np.int64))
        active, self.cycles = np.flatnonzero(self.free), []
        for _ in range(PROPOSALS):
            count = propose_cycle(net, self.labels, rng, active, self.free, move)
            if count:
                self.cycles.append((move.edge[:count].copy(), move.label[:count].copy()))


@pytest.fixture(scope="module", params=["ssl", "sll", "ssl,sll", "aab,abc,bcc,abb"])
def walks(request):
    return Walks(pebble(), request.param)


def test_many_walks_close(walks):
    assert len(walks.cycles) > PROPOSALS / 10
    assert len({tuple(sorted(edges)) for edges, _ in walks.cycles}) > 10


def test_a_cycle_goes_from_face_to_face_and_meets_each_once(walks):
    for edges, _ in walks.cycles:
        assert len(set(edges.tolist())) == len(edges) <= LONGEST_CYCLE
        faces, counts = np.unique(walks.mesh.edge_faces[edges], return_counts=True)
        assert (counts == 2).all()
        assert len(faces) == len(edges)
        for one, other in zip(edges, np.roll(edges, -1), strict=True):
            assert set(walks.mesh.edge_faces[one]) & set(walks.mesh.edge_faces[other])


def test_a_cycle_exchanges_two_labels_that_alternate(walks):
    for edges, new in walks.cycles:
        old = walks.labels[edges]
        assert len(edges) % 2 == 0
        assert old[0] != old[1]
        assert (old[::2] == old[0]).all()
        assert (old[1::2] == old[1]).all()
        np.testing.assert_array_equal(new, np.roll(old, 1))


def test_every_face_keeps_its_multiset(walks):
    before = np.sort(walks.labels[walks.mesh.face_edges], axis=1)
    for edges, new in walks.cycles:
        labels = walks.labels.copy()
        labels[edges] = new
        assert (labels != walks.labels).sum() == len(edges)
        np.testing.assert_array_equal(np.sort(labels[walks.mesh.face_edges], axis=1), before)


def test_cycles_keep_to_free_edges():
    mesh = small_ring()
    free = mesh.vertices[mesh.edges].mean(axis=1)[:, 0] > 0
    walks = Walks(mesh, "ssl", free=free)
    assert len(walks.cycles) > 20
    assert all(free[edges].all() for edges, _ in walks.cycles)


def test_no_cycle_is_longer_than_its_room():
    walks = Walks(small_ring(), "ssl")
    lengths = [len(edges) for edges, _ in walks.cycles]
    assert min(lengths) >= 4
    assert 10 < max(lengths) <= LONGEST_CYCLE


def test_one_class_needs_cycles_alone_and_a_free_palette_none():
    assert cycle_share(palette_of_classes(1).allowed) == 1
    assert cycle_share(parse_multisets("sll").allowed) == 1
    assert cycle_share(parse_multisets("sss,sll").allowed) == 0.5
    assert all(cycle_share(palette_of_classes(k).allowed) == 0 for k in (2, 3, 4, 10))


def test_an_annealing_of_one_class_moves_by_cycles_and_prices_them_truly():
    """Without flips only cycles can change one class: the energy falls by what solving anew says."""
    walks, mesh = Walks(pebble(), "ssl"), pebble()
    net, problem, labels = connectivity(mesh), dense_problem(mesh), walks.labels.copy()
    model, edges = problem.model(mesh.edges, walks.lengths[labels]), np.arange(len(labels))
    before = problem.minimum(mesh.edges, walks.lengths[labels])
    schedule = Schedule(0.02, 4000, 0.0, edges, walks.free)
    change, taken = anneal(
        net, model, labels, walks.lengths, walks.palette.allowed.copy(), np.random.default_rng(1), schedule
    )
    after = problem.minimum(mesh.edges, walks.lengths[labels])
    assert taken > 10
    assert (labels[mesh.face_edges].sum(axis=1) == 1).all()
    assert after - before == pytest.approx(change, abs=1e-9)
    assert after < before


def test_a_share_asked_for_gives_cycles_to_any_palette():
    """Annealing with cycles only keeps the number of faces of each class."""
    walks, mesh = Walks(pebble(), "ssl,sll"), pebble()
    net, labels = connectivity(mesh), walks.labels.copy()
    model = dense_problem(mesh).model(mesh.edges, walks.lengths[labels])
    schedule = Schedule(1.0, 2000, 0.0, np.arange(len(labels)), walks.free, cycles=1.0)
    anneal(net, model, labels, walks.lengths, walks.palette.allowed.copy(), np.random.default_rng(1), schedule)
    assert (labels != walks.labels).any()
    np.testing.assert_array_equal(
        walks.palette.class_of(labels[mesh.face_edges]), walks.palette.class_of(walks.labels[mesh.face_edges])
    )
