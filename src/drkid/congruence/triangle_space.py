"""The paper's virtual 3D space: a triangle is the point of its ascending edge lengths (section K-means Clustering)."""

from dataclasses import dataclass

import numpy as np

from drkid.mesh import Floats, Ints, TriMesh, read_only


def ascending_lengths(mesh: TriMesh) -> Floats:
    """(F, 3): shortest, middle and longest side of each face."""
    return read_only(np.sort(mesh.side_lengths, axis=1))


def class_means(points: Floats, face_class: Ints, classes: int) -> Floats:
    """(k, 3): mean of the points (F, 3) of each class (equation 2 of the paper); nan where a class is empty."""
    count = np.bincount(face_class, minlength=classes)
    total = np.stack([np.bincount(face_class, weights=points[:, i], minlength=classes) for i in range(3)], axis=1)
    return np.divide(total, count[:, None], out=np.full((classes, 3), np.nan), where=count[:, None] > 0)


@dataclass(frozen=True)
class ClusteringError:
    """Distances of triangles from their classes.

    `energy` is the sum of squared distances (equation 1 with 3), `maximum` and `mean` are of the Euclidean distance:
    the paper calls d squared and Euclidean in turn, but its figures in percent of an edge are lengths.
    """

    energy: float
    maximum: float
    mean: float


def clustering_error(points: Floats, face_class: Ints, class_lengths: Floats) -> ClusteringError:
    """Errors of points (F, 3) against the lengths (k, 3) of their classes (F,)."""
    distance = np.linalg.norm(points - class_lengths[face_class], axis=1)
    return ClusteringError(float((distance**2).sum()), float(distance.max()), float(distance.mean()))
