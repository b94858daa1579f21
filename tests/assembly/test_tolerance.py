import numpy as np
import pytest
from exact_shapes import icosahedron
from hinged import framework_of, graph_of

from drkid.assembly import tolerance
from drkid.assembly.breadth_first import chained
from drkid.assembly.hinge_framework import HingeFramework
from drkid.assembly.relaxation import relaxed
from drkid.assembly.tolerance import Response

ACCURACY = 1e-4


@pytest.fixture(scope="module")
def framework() -> HingeFramework:
    return framework_of(icosahedron().scaled(1.0))


def test_the_exact_scatter_is_that_of_prints_that_are_drawn(framework, monkeypatch) -> None:
    places = chained(framework)
    exact = Response(framework, places).scattered(ACCURACY)
    monkeypatch.setattr(tolerance, "MOST_EXACT", 0)
    monkeypatch.setattr(tolerance, "SAMPLES", 2000)
    drawn = Response(framework, places).scattered(ACCURACY)
    assert drawn == pytest.approx(exact, rel=0.1)
    assert drawn.mean() == pytest.approx(exact.mean(), rel=0.02)


def test_scatter_is_what_relaxing_misprinted_pieces_leaves(framework) -> None:
    """Monte Carlo with the true, nonlinear relaxation: each printed side turned and shifted a little."""
    rng = np.random.default_rng(0)
    places, total = chained(framework), np.zeros((len(framework.pieces), 2))
    count = 60
    for _ in range(count):
        error = ACCURACY * rng.standard_normal((len(framework.pieces), 2, 2, 3))
        frames, half = framework.frames.copy(), framework.half_lengths.copy()
        axes = framework.frames[..., :3, :3]
        frames[..., :3, 3] += np.einsum("jsab,jsb->jsa", axes, error.mean(axis=2))
        spread = (error[:, :, 1] - error[:, :, 0]) / 2
        half += spread[..., 0]
        spread[..., 0] = 0.0
        frames[..., :3, 0] += np.einsum("jsab,jsb->jsa", axes, spread) / half[..., None]
        printed = HingeFramework(framework.count, framework.pieces, frames, half, framework.bend_radians)
        total += (relaxed(printed, places).gaps ** 2).sum(axis=-1)
    found = np.sqrt(total / count)
    exact = Response(framework, places).scattered(ACCURACY)
    assert found.mean() == pytest.approx(exact.mean(), rel=0.05)
    assert found == pytest.approx(exact, rel=0.5)


def test_the_scatter_sums_to_the_redundancy(framework) -> None:
    """Trace of 1 − H: six equations for each hinge, six unknowns for each piece but for the motions of the whole."""
    squares = (Response(framework, chained(framework)).scattered(1.0) ** 2).sum()
    redundant = 6 * len(framework.pieces) - (6 * framework.count - 6)
    assert squares / 2 == pytest.approx(redundant, rel=1e-4)


def test_it_grows_with_the_error_of_the_process(framework) -> None:
    response = Response(framework, chained(framework))
    assert response.scattered(0.2) == pytest.approx(2 * response.scattered(0.1))


def test_errors_that_all_pieces_share_do_nothing_where_they_only_scale_the_shape() -> None:
    """All sides of an icosahedron's only mould standing back alike: a smaller icosahedron that closes."""
    mesh = icosahedron()
    framework, graph = framework_of(mesh), graph_of(mesh)
    response = Response(framework, chained(framework))
    one_mould = response._mould_errors(np.zeros_like(graph.pieces))
    rest = response._at_rest(one_mould).reshape(30, 6, 2, 3)
    longer, back, lifted = (rest[:, :, 1] + sign * rest[:, :, 0] for sign in (-1, 1, 1))
    assert np.abs(longer[..., 0]).max() < 1e-5
    assert np.abs(back[..., 1]).max() < 1e-5
    assert np.abs(lifted[..., 2]).max() < 1e-5
    assert np.abs((rest[:, :, 1] - rest[:, :, 0])[..., 2]).max() > 0.1
    assert response.shared(graph.sides, 0.1).max() > 0
