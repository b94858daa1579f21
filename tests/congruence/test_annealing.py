import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from quadratic_problem import assert_models_agree, dense_problem, pebble, small_ring

from drkid.congruence.annealing import (
    LEAST_VALENCE,
    LONGEST,
    MOST_VALENCE,
    SHORTEST,
    Schedule,
    anneal,
    flip,
    flip_is_sound,
    quad_of,
    side_of,
)
from drkid.congruence.labelling import nearest_labels, repaired
from drkid.congruence.palette import palette_of_classes
from drkid.congruence.quadratic_model import connectivity
from drkid.mesh import TriMesh

SEEDS = st.integers(0, 2**32 - 1)
CASES = [(2, pebble), (3, pebble), (10, pebble), (4, small_ring), (1, small_ring)]
NO_SIZE = np.array([1e-9, 1e9])  # a palette with which no edge is too long, too short, or its face too small


class Run:
    """A labelled mesh and its model, which `anneal` changes in place."""

    def __init__(self, mesh, classes):
        self.mesh, self.palette, rng = mesh, palette_of_classes(classes), np.random.default_rng(0)
        self.lengths = np.array(self.palette.ratios) / np.mean(self.palette.ratios)
        labels = repaired(mesh, nearest_labels(mesh, self.lengths), self.palette, self.lengths, rng)
        assert labels is not None
        self.labels, self.net, self.problem = labels, connectivity(mesh), dense_problem(mesh)
        self.model = self.fresh_model

    @property
    def fresh_model(self):
        return self.problem.model(self.net.edges, self.lengths[self.labels])

    @property
    def minimum(self):
        """Of the energy, solved anew."""
        return self.problem.minimum(self.net.edges, self.lengths[self.labels])

    @property
    def result(self):
        return TriMesh(self.mesh.vertices, self.net.faces)

    def anneal(self, rng, temperature=0.1, steps=6000, flips=0.3, free=None, active=None):
        """The change of the energy and the number of moves taken."""
        free = np.ones(len(self.labels), bool) if free is None else free
        active = np.arange(len(self.labels)) if active is None else active
        schedule = Schedule(temperature, steps, flips, active, free)
        return anneal(self.net, self.model, self.labels, self.lengths, self.palette.allowed.copy(), rng, schedule)


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[1].__name__}-{case[0]}")
def annealed(request):
    """A run after 6000 steps: it, the energy before, its change, and the moves taken."""
    classes, mesh = request.param
    run = Run(mesh(), classes)
    before = run.minimum
    return run, before, *run.anneal(np.random.default_rng(1))


def assert_net_is_that_of_its_faces(net, vertices):
    """Every array of the connectivity agrees with the mesh made anew from the faces."""
    mesh = TriMesh(vertices, net.faces)
    assert mesh.is_closed_manifold
    np.testing.assert_array_equal(net.valence, mesh.valence)
    np.testing.assert_array_equal(net.joined, connectivity(mesh).joined)
    ends = np.sort(net.edges, axis=1)
    sides = np.sort(np.stack([net.faces, np.roll(net.faces, -1, axis=1)], axis=2), axis=2)
    np.testing.assert_array_equal(ends[net.face_edges], sides)
    assert len(np.unique(ends, axis=0)) == len(ends) == len(mesh.edges)
    for edge, faces in enumerate(net.edge_faces):
        assert set(faces) == set(np.flatnonzero((net.face_edges == edge).any(axis=1)))


def test_something_was_annealed(annealed):
    run, before, change, taken = annealed
    assert taken > 30
    assert (run.labels != Run(run.mesh, len(run.palette.multisets)).labels).any()
    assert change < -0.1 * before  # the first labels are far from the best


def test_every_face_keeps_to_the_allowed_multisets(annealed):
    run, *_ = annealed
    assert run.palette.allowed[tuple(run.labels[run.net.face_edges].T)].all()


def test_the_connectivity_stays_a_closed_manifold_of_its_genus(annealed):
    run, *_ = annealed
    assert_net_is_that_of_its_faces(run.net, run.mesh.vertices)
    assert run.result.genus == run.mesh.genus
    assert run.result.volume > 0
    assert (run.net.faces != run.mesh.faces).any()


def test_valences_stay_in_their_range(annealed):
    run, *_ = annealed
    assert run.net.valence.min() >= LEAST_VALENCE
    assert run.net.valence.max() <= MOST_VALENCE


def test_the_change_of_the_energy_is_that_of_solving_anew(annealed):
    run, before, change, _ = annealed
    assert change == pytest.approx(run.minimum - before, abs=1e-8 * before)


def test_the_model_is_that_made_anew(annealed):
    run, *_ = annealed
    assert_models_agree(run.model, run.fresh_model, 1e-8)


@pytest.mark.parametrize("flips", [0.0, 1.0])
@pytest.mark.parametrize("classes", [2, 10])
def test_every_single_step_returns_its_price(classes, flips):
    """At an endless temperature every sound move is taken: one step's change is one move's price."""
    run, rng, changed = Run(pebble(), classes), np.random.default_rng(2), []
    energy, edges, labels = run.minimum, run.net.edges.copy(), run.labels.copy()
    for _ in range(300):
        change, taken = run.anneal(rng, np.inf, 1, flips)
        if taken:
            energy, before = run.minimum, energy
            assert change == pytest.approx(energy - before, abs=1e-9)
            turned = (run.net.edges != edges).any(axis=1)
            assert turned.sum() == flips
            changed.append(int((run.labels != labels)[~turned].sum()))
            edges, labels = run.net.edges.copy(), run.labels.copy()
        else:
            assert change == 0
            assert (run.labels == labels).all()
    assert set(changed) == ({0, 1, 2} if flips else {1, 2, 3})  # beside a flip up to two, else one to three


def test_edges_that_are_not_free_never_change():
    run = Run(pebble(subdivisions=2), 2)
    free = run.mesh.vertices[run.mesh.edges].mean(axis=1)[:, 0] > 0
    labels, edges = run.labels.copy(), run.net.edges.copy()
    _, taken = run.anneal(np.random.default_rng(3), free=free)
    assert taken > 50
    np.testing.assert_array_equal(run.labels[~free], labels[~free])
    np.testing.assert_array_equal(run.net.edges[~free], edges[~free])
    assert (run.net.edges[free] != edges[free]).any()
    assert (run.labels[free] != labels[free]).any()


def test_changes_stay_within_two_faces_of_the_active_edges():
    run = Run(pebble(subdivisions=2), 10)
    labels, edges = run.labels.copy(), run.net.edges.copy()
    _, taken = run.anneal(np.random.default_rng(4), active=np.array([17]), flips=0.0)
    assert taken > 5
    near = run.net.face_edges[run.net.edge_faces[17]]
    assert set(np.flatnonzero(run.labels != labels)) <= set(near.ravel())
    np.testing.assert_array_equal(run.net.edges, edges)


def test_the_same_seed_anneals_the_same_and_another_does_not():
    runs = [Run(pebble(), 2) for _ in range(3)]
    results = [run.anneal(np.random.default_rng(seed)) for run, seed in zip(runs, (7, 7, 8), strict=True)]
    assert results[0] == results[1] != results[2]
    np.testing.assert_array_equal(runs[0].labels, runs[1].labels)
    np.testing.assert_array_equal(runs[0].net.faces, runs[1].net.faces)


def test_without_heat_no_move_raises_the_energy():
    run, rng = Run(pebble(), 2), np.random.default_rng(9)
    changes = [run.anneal(rng, 1e-300, 1)[0] for _ in range(500)]
    assert min(changes) < 0
    assert max(changes) == 0


def test_a_quad_is_the_two_faces_of_its_edge(potato):
    net = connectivity(potato)
    for edge in range(len(potato.edges)):
        (a, b, c, d), (f, g), sides = quad_of(net, edge)
        assert {a, b} == set(net.edges[edge])
        for face, corners in ((f, (a, b, c)), (g, (b, a, d))):
            assert corners in [tuple(np.roll(net.faces[face], -i)) for i in range(3)]
        assert [set(net.edges[side]) for side in sides] == [{b, c}, {c, a}, {a, d}, {d, b}]


def test_side_of_finds_the_side_or_minus_one(potato):
    net = connectivity(potato)
    assert [side_of(net, 5, int(edge)) for edge in net.face_edges[5]] == [0, 1, 2]
    elsewhere = np.setdiff1d(np.arange(len(potato.edges)), net.face_edges[5])
    assert side_of(net, 5, int(elsewhere[0])) == -1


@settings(max_examples=10)
@given(SEEDS)
def test_flips_keep_the_net_whole_and_two_more_turn_an_edge_back(potato, seed):
    rng, net = np.random.default_rng(seed), connectivity(potato)
    for edge in rng.integers(len(potato.edges), size=60).tolist():
        corners, _, _ = quad_of(net, edge)
        if flip_is_sound(net, potato.vertices, NO_SIZE, corners):
            flip(net, edge)
    assert (net.faces != potato.faces).any()
    assert_net_is_that_of_its_faces(net, potato.vertices)
    faces, ends = net.faces.copy(), np.sort(net.edges[0])
    flip(net, 0)
    assert not np.isin(net.edges[0], ends).any()
    flip(net, 0)
    np.testing.assert_array_equal(np.sort(net.edges[0]), ends)
    assert {frozenset(f) for f in net.faces.tolist()} == {frozenset(f) for f in faces.tolist()}


def kite(height=0.0, width=1.0):
    """Corners a, b, c, d of two triangles across ab, d lifted by `height`; everything else far away."""
    return np.array([[0.0, -0.5, 0], [0, 0.5, 0], [-width / 2, 0, 0], [width / 2, 0, height]])


def lonely_net(valence=(6, 6, 6, 6), joined=False):
    net = connectivity(pebble())
    net.valence[:4], net.joined[:4, :4] = valence, False
    net.joined[2, 3] = net.joined[3, 2] = joined
    return net


@pytest.mark.parametrize(
    ("position", "net", "sound"),
    [
        (kite(), lonely_net(), True),
        (kite(), lonely_net(valence=(5, 5, 7, 7)), True),
        (kite(), lonely_net(valence=(4, 6, 6, 6)), False),
        (kite(), lonely_net(valence=(6, 4, 6, 6)), False),
        (kite(), lonely_net(valence=(6, 6, 8, 6)), False),
        (kite(), lonely_net(valence=(6, 6, 6, 8)), False),
        (kite(), lonely_net(joined=True), False),
        (kite(width=SHORTEST - 0.01), lonely_net(), False),
        (kite(width=SHORTEST + 0.01), lonely_net(), True),
        (kite(width=LONGEST * 1.1 + 0.01), lonely_net(), False),
        (kite(width=LONGEST * 1.1 - 0.01), lonely_net(), True),
    ],
)
def test_flips_are_refused_for_topology_and_length(position, net, sound):
    assert flip_is_sound(net, position, np.array([1.0, 1.1]), (0, 1, 2, 3)) == sound


@pytest.mark.parametrize(("angle_degrees", "sound"), [(0, True), (59, True), (61, False), (120, False), (180, False)])
def test_flips_are_refused_across_a_sharp_angle(angle_degrees, sound):
    """The two new faces hang on the axis cd, each turned by half the angle."""
    half = np.radians(angle_degrees) / 2
    lean = 0.5 * np.array([np.cos(half), np.sin(half)])
    position = np.array([[0, -lean[0], lean[1]], [0, lean[0], lean[1]], [-0.5, 0, 0], [0.5, 0, 0]])
    assert flip_is_sound(lonely_net(), position, np.array([0.9, 1.0]), (0, 1, 2, 3)) == sound


def test_flips_to_slivers_are_refused():
    position = kite()
    position[0, 1] = -0.2  # near the new edge: twice the new face's area is 0.2
    assert not flip_is_sound(lonely_net(), position, np.array([1.0, 1.1]), (0, 1, 2, 3))
    position[0, 1] = -0.3
    assert flip_is_sound(lonely_net(), position, np.array([1.0, 1.1]), (0, 1, 2, 3))
