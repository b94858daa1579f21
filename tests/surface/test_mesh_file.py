"""M_i of a mesh file: formats, welding, bodies, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from handled_shapes import barred_torus

from drkid.errors import InputError, SpecError
from drkid.mesh import TriMesh
from drkid.spec import KitSpec
from drkid.surface import extract_surface


def save(mesh: TriMesh, path: Path, *, soup: bool = False) -> Path:
    vertices, faces = mesh.vertices, mesh.faces
    if soup:
        vertices, faces = mesh.corners.reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


def both(one: TriMesh, two: TriMesh) -> TriMesh:
    return TriMesh(
        np.concatenate([one.vertices, two.vertices]), np.concatenate([one.faces, two.faces + len(one.vertices)])
    )


def refusal(path: Path, spec: KitSpec | None = None) -> str:
    with pytest.raises(InputError) as caught:
        extract_surface(path, spec or KitSpec())
    return str(caught.value)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off", ".glb", ".3mf"])
@pytest.mark.parametrize("soup", [False, True])
def test_every_format_gives_the_same_surface(suffix, soup, potato, tmp_path):
    surface = extract_surface(save(potato, tmp_path / f"a{suffix}", soup=soup), KitSpec(unit="nm"))
    assert surface.mesh.is_closed_manifold
    assert (len(surface.mesh.vertices), len(surface.mesh.faces)) == (len(potato.vertices), len(potato.faces))
    assert surface.mesh.volume == pytest.approx(potato.volume, rel=1e-5)
    np.testing.assert_allclose(surface.mesh.extents, potato.extents, rtol=1e-5)
    assert (surface.source.voxel_unit, surface.source.voxel_size) == ("nm", None)
    assert surface.max_displacement_voxels == 0


def test_inside_out_and_mixed_faces_are_turned_outwards(ring, tmp_path):
    faces = np.array(ring.faces)
    faces[::3] = faces[::3, ::-1]
    for name, mesh in {"out": ring.flipped(), "mixed": TriMesh(ring.vertices, faces)}.items():
        surface = extract_surface(save(mesh, tmp_path / f"{name}.ply"), KitSpec())
        assert surface.mesh.is_closed_manifold
        assert surface.mesh.genus == 1
        assert surface.mesh.volume == pytest.approx(ring.volume)


def test_doubled_degenerate_and_idle_things_are_dropped(potato, tmp_path):
    again = np.concatenate([potato.faces, potato.faces[:5], potato.faces[:5, ::-1], [[3, 3, 7]]])
    path = save(TriMesh(np.concatenate([potato.vertices, [[9, 9, 9]]]), again), tmp_path / "a.ply")
    mesh = extract_surface(path, KitSpec()).mesh
    assert mesh.is_closed_manifold
    assert (len(mesh.vertices), len(mesh.faces)) == (len(potato.vertices), len(potato.faces))


def test_bodies_are_counted_by_volume(potato, ring, tmp_path):
    path = save(both(potato.scaled(0.1), ring.flipped()), tmp_path / "a.ply")
    largest, second = (extract_surface(path, KitSpec(component=n)) for n in (None, 2))
    assert (largest.mesh.genus, second.mesh.genus) == (1, 0)
    assert (largest.components, largest.debris_dropped) == (2, 1)
    assert "body 1 of 2" in largest.notes[0]
    assert second.mesh.volume == pytest.approx(potato.volume / 1000)
    assert "found: 2 bodies" in refusal(path, KitSpec(component=3))


@pytest.mark.parametrize(
    ("given", "words"),
    [({"label": 3}, "label is"), ({"threshold": 1.0, "spacing": (1, 1, 1)}, "threshold and spacing")],
)
def test_parameters_of_volumes_are_refused(given, words, potato, tmp_path):
    with pytest.raises(SpecError, match=f"{words}.*for volumes"):
        extract_surface(save(potato, tmp_path / "a.ply"), KitSpec(**given))


# ---- what is refused


def test_an_open_mesh_is_refused_with_its_open_edges(potato, tmp_path):
    message = refusal(save(potato.submesh(np.arange(1, len(potato.faces))), tmp_path / "a.ply"))
    assert "not closed" in message
    assert "3 open edges" in message
    assert "Blender" in message


def test_non_manifold_meshes_are_refused_with_their_count(potato, tmp_path):
    fin = np.concatenate([potato.faces, [[*potato.edges[0], len(potato.vertices)]]])
    finned = TriMesh(np.concatenate([potato.vertices, [[3, 3, 3]]]), fin)
    assert "1 edges with more than two faces" in refusal(save(finned, tmp_path / "a.ply"))
    top, bottom = potato.vertices[:, 2].argmax(), potato.vertices[:, 2].argmin()
    pinched = TriMesh(potato.vertices, np.where(potato.faces == bottom, top, potato.faces))
    assert "1 pinched vertices" in refusal(save(pinched, tmp_path / "b.ply"))


def test_a_surface_without_an_outside_is_refused(tmp_path):
    """The Klein bottle: a square grid glued with a twist."""
    n = 8
    u, v = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")

    def at(i, j):
        wrapped = i >= n
        return (i % n) * n + np.where(wrapped, -j, j) % n

    a, b, c, d = at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    bottle = TriMesh(np.random.default_rng(0).random((n * n, 3)), faces)
    assert bottle.open_edges == 0
    assert "not orientable" in refusal(save(bottle, tmp_path / "a.ply"))


def test_flat_faces_are_refused(tmp_path):
    mesh = TriMesh(
        np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
        np.array([[0, 2, 1], [0, 3, 2], [2, 3, 1], [0, 1, 4], [1, 3, 4], [0, 4, 3]]),
    )
    assert mesh.is_closed_manifold
    assert "1 faces without area" in refusal(save(mesh, tmp_path / "a.ply"))
    point = TriMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert "no face of any area" in refusal(save(point, tmp_path / "b.ply"))


def test_broken_files_are_refused(potato, tmp_path):
    for suffix in (".stl", ".ply", ".obj", ".off", ".glb", ".3mf"):
        (tmp_path / f"a{suffix}").touch()
        assert "is empty" in refusal(tmp_path / f"a{suffix}")
        (tmp_path / f"a{suffix}").write_bytes(b"\x00\x01neither text nor triangles\xff" * 40)
        message = refusal(tmp_path / f"a{suffix}")
        assert "cannot be read" in message or "without faces" in message
    assert "does not exist" in refusal(tmp_path / "no.stl")
    for suffix in (".stl", ".ply", ".glb", ".3mf"):
        whole = save(potato, tmp_path / f"b{suffix}").read_bytes()
        (tmp_path / f"b{suffix}").write_bytes(whole[: len(whole) // 2])
        assert "cannot be read" in refusal(tmp_path / f"b{suffix}")


def test_points_and_senseless_coordinates_are_refused(potato, tmp_path):
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    message = refusal(tmp_path / "points.obj")
    assert "without faces" in message or "cannot be read" in message
    vertices = np.array(potato.vertices)
    vertices[:2, 0] = np.nan
    assert "2 of 162 vertices" in refusal(save(potato.moved(vertices), tmp_path / "a.ply"))


@pytest.mark.parametrize(
    ("name", "words"), [("empty_mesh.ply", "0 faces"), ("open_boundary_peanut.obj", "188 open edges")]
)
def test_bad_meshes_from_the_wild_are_refused(name, words, shared_data):
    assert words in refusal(shared_data / "bad" / name)


def test_handles_of_a_mesh_are_kept_or_closed_and_that_is_said(tmp_path):
    mesh = barred_torus(size=28)
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / "barred.ply")
    kept, closed = (extract_surface(tmp_path / "barred.ply", KitSpec(max_genus=most, unit="nm")) for most in (None, 1))
    assert (kept.mesh.genus, closed.mesh.genus) == (2, 1)
    assert kept.notes == ("the surface has 2 handles; where they are noise, --max-genus closes the smallest ones",)
    (note,) = closed.notes
    told = r"a handle closed \(--max-genus\): a bridge cut at \((\S+), (\S+), (\S+)\) nm, (\S+) nm around"
    found = re.fullmatch(told, note)
    assert found is not None
    assert float(found[2]) == pytest.approx(0.4, abs=0.1)
    assert float(found[4]) == pytest.approx(2 * np.pi * 0.25, rel=0.35)
