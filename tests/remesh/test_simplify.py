import nibabel
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from remeshed import check, surface_of
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

from drkid.errors import RemeshError, SpecError
from drkid.intersection import self_intersections
from drkid.measure import edge_spread, hausdorff
from drkid.mesh import TriMesh
from drkid.remesh import simplify
from drkid.remesh.simplify import fewest_vertices
from drkid.spec import KitSpec


@pytest.mark.parametrize("faces", [116, 172, 496])
@pytest.mark.parametrize("name", ["blob", "ring"])
def test_smooth_shapes_come_out_even_and_regular(request, name, faces):
    mesh = request.getfixturevalue(name)
    spec = KitSpec(faces=faces)
    found = simplify(surface_of(mesh), spec)
    check(found.mesh, mesh, spec.vertex_count(mesh.genus))
    assert len(found.mesh.faces) == faces
    assert found.notes == ()
    assert edge_spread(found.mesh) <= 0.12
    assert np.isin(found.mesh.valence, (5, 6, 7)).mean() >= 0.95
    assert hausdorff(mesh, found.mesh, np.random.default_rng(0), 5000).max < 0.06 * mesh.diagonal
    assert len(found.energy) == 5 + 1 + 30
    assert all(np.diff(found.energy) <= 1e-12 * found.energy[0])


@pytest.mark.parametrize(("name", "vertices"), [("cup", 60), ("thin_ring", 90), ("fine_box", 40), ("cup", 400)])
def test_parts_thinner_than_an_edge_are_mended(request, name, vertices):
    mesh = request.getfixturevalue(name)
    check(simplify(surface_of(mesh), KitSpec(vertices=vertices)).mesh, mesh, vertices)


def test_mending_says_so(thin_ring):
    found = simplify(surface_of(thin_ring), KitSpec(vertices=60, lloyd_iterations=2, newton_iterations=0))
    check(found.mesh, thin_ring, 60)
    assert any("thinner than an edge" in note for note in found.notes)


def test_a_mesh_with_fewer_vertices_than_wanted_is_no_hindrance(box):
    check(simplify(surface_of(box), KitSpec(vertices=300)).mesh, box, 300)


@settings(max_examples=10)
@given(st.integers(0, 99), st.sampled_from([1e-3, 1.0, 1e4]))
def test_motion_and_scale_carry_the_result_with_them(potato, seed, scale):
    # Rounding differs, and is amplified by each iteration: few of them, and a tolerance to match.
    spec = KitSpec(vertices=30, newton_iterations=3)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    moved = TriMesh(scale * (potato.vertices @ turn.T + [1.0, 2.0, -3.0]), potato.faces)
    one, two = (simplify(surface_of(m), spec) for m in (potato, moved))
    assert np.array_equal(one.mesh.faces, two.mesh.faces)
    expected = scale * (one.mesh.vertices @ turn.T + [1.0, 2.0, -3.0])
    assert np.allclose(two.mesh.vertices, expected, atol=1e-6 * scale)
    assert np.allclose(two.energy, np.array(one.energy) * scale**4, rtol=1e-6)


def test_the_seed_decides(blob):
    meshes = [simplify(surface_of(blob), KitSpec(vertices=50, seed=seed)).mesh for seed in (0, 0, 1)]
    assert np.array_equal(meshes[0].vertices, meshes[1].vertices)
    assert np.array_equal(meshes[0].faces, meshes[1].faces)
    assert not np.array_equal(meshes[0].vertices, meshes[2].vertices)


def test_progress_goes_from_nothing_to_all(blob):
    told = []
    simplify(surface_of(blob), KitSpec(vertices=40), lambda _what, fraction: told.append(fraction))
    assert told[0] == 0
    assert told[-1] == 1
    assert told == sorted(told)
    assert len(told) > 20


@pytest.mark.parametrize(("genus", "least"), [(0, 4), (1, 7), (2, 10), (3, 10), (4, 11), (6, 12)])
def test_the_fewest_vertices_of_a_genus(genus, least):
    assert fewest_vertices(genus) == least


def test_too_few_vertices_for_the_genus_are_refused(ring):
    with pytest.raises(SpecError, match="at least 7 vertices") as error:
        simplify(surface_of(ring), KitSpec(vertices=6))
    assert "--faces" in error.value.remedy


def test_too_many_vertices_are_refused(ring):
    with pytest.raises(SpecError, match="at most"):
        simplify(surface_of(ring), KitSpec(vertices=1_000_000))


def test_too_few_to_follow_the_shape_are_refused_with_the_number_that_would_do(thin_ring):
    with pytest.raises(RemeshError, match="no closed mesh of 7 vertices") as error:
        simplify(surface_of(thin_ring), KitSpec(vertices=7))
    wanted = int(error.value.remedy.split()[1])
    again = simplify(surface_of(thin_ring), KitSpec(faces=wanted))
    assert again.mesh.genus == 1
    assert len(again.mesh.faces) == wanted
    cuts = len(self_intersections(again.mesh))
    assert any(f"cuts itself at {cuts} pairs" in note for note in again.notes) is (cuts > 0)


@pytest.mark.parametrize("change", ["open", "inward", "twice"])
def test_a_surface_that_is_none_is_refused(blob, change):
    mesh = {
        "open": lambda: blob.submesh(np.arange(len(blob.faces) - 1)),
        "inward": blob.flipped,
        "twice": lambda: TriMesh(
            np.concatenate([blob.vertices, blob.vertices + 9]),
            np.concatenate([blob.faces, blob.faces + len(blob.vertices)]),
        ),
    }[change]()
    with pytest.raises(RemeshError, match="cannot be remeshed"):
        simplify(surface_of(mesh), KitSpec())


@pytest.mark.parametrize("faces", [172, 300])
def test_the_cow_keeps_its_legs(shared_data, faces):
    cow = trimesh.load_mesh(shared_data / "spot_uv_seams.obj", process=False)
    vertices, index = np.unique(np.asarray(cow.vertices).round(9), axis=0, return_inverse=True)
    mesh = TriMesh(vertices, index.ravel()[np.asarray(cow.faces)])
    found = simplify(surface_of(mesh), KitSpec(faces=faces)).mesh
    check(found, mesh, (faces + 4) // 2)
    assert found.volume > 0.85 * mesh.volume
    assert (
        hausdorff(mesh, found, np.random.default_rng(0), 5000).max < 0.75 * found.mean_edge
    )  # no leg, horn or ear is lost


@pytest.mark.parametrize(
    ("name", "sigma", "genus", "faces"),
    [("bean", 1.0, 0, 172), ("branched", 1.0, 0, 250), ("genus3", 0.0, 3, 300), ("noise_tunnels", 0.0, 2, 400)],
)
def test_mitochondria(shared_data, name, sigma, genus, faces):
    mask = np.pad(np.asarray(nibabel.load(shared_data / f"urocell_mito_{name}.nii.gz").dataobj) > 0, 3)
    smooth = gaussian_filter(mask.astype(np.float64), sigma)
    vertices, triangles, *_ = marching_cubes(smooth, 0.5, gradient_direction="ascent")
    mesh = TriMesh(vertices, triangles)
    assert mesh.genus == genus
    spec = KitSpec(faces=faces)
    check(simplify(surface_of(mesh), spec).mesh, mesh, spec.vertex_count(genus))
