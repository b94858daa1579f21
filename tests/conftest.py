"""What tests share: the folder of real shapes, and small closed meshes that are made, not loaded."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import settings

from drkid.kit import Kit, Source, Surface
from drkid.mesh import TriMesh
from drkid.pipeline import make_kit
from drkid.remesh import simplify
from drkid.spec import KitSpec

settings.register_profile("drkid", deadline=None, derandomize=True)  # the first call may compile
settings.load_profile("drkid")

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The real volumes and meshes that the repository may not hold; skips where they are not."""
    folder = Path(os.environ.get("DRKID_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real shapes at {folder}: set DRKID_DATA to their folder")
    return folder


def potato_of(subdivisions: int) -> TriMesh:
    """A smooth closed surface, genus 0, neither round nor symmetric."""
    sphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    x, y, z = np.asarray(sphere.vertices).T
    radius = 1 + 0.15 * np.sin(2 * x + 1) + 0.1 * np.cos(3 * y * z) + 0.08 * x * z
    return TriMesh(np.stack([1.4 * x, y, 0.9 * z], axis=1) * radius[:, None], np.asarray(sphere.faces))


@pytest.fixture(scope="session")
def potato() -> TriMesh:
    """The potato with 320 faces."""
    return potato_of(2)


@pytest.fixture(scope="session")
def pebble() -> TriMesh:
    """The potato remeshed to 100 even faces: what a solver is given."""
    return simplify(Surface(potato_of(4), Source("potato", "0" * 64)), KitSpec(faces=100)).mesh


@pytest.fixture(scope="session")
def ring() -> TriMesh:
    """A torus: genus 1."""
    torus = trimesh.creation.torus(2.0, 0.8, major_sections=24, minor_sections=12)
    return TriMesh(np.asarray(torus.vertices), np.asarray(torus.faces))


@pytest.fixture(scope="session")
def potato_file(potato, tmp_path_factory) -> Path:
    """The potato as a mesh file."""
    path = tmp_path_factory.mktemp("input") / "potato.stl"
    trimesh.Trimesh(potato.vertices, potato.faces, process=False).export(path)
    return path


@pytest.fixture(scope="session")
def kit(potato_file) -> Kit:
    """A small kit of the potato: 60 pieces in four classes, by the solver that is the quicker one here."""
    spec = KitSpec(method="pressure", faces=60, classes=4, tolerance_percent=5, max_iterations=4000, documents=False)
    return make_kit(potato_file, spec)


@pytest.fixture(scope="session")
def kit_folder(kit, tmp_path_factory) -> Path:
    """That kit as written. Tests that change it take a copy."""
    return kit.write(tmp_path_factory.mktemp("kits") / "potato")
