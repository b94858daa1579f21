"""Other remeshers, run by the interpreter of an environment of their own: see remesh.py, which starts this.

Says in one line of JSON which of `TOOLS` are there; then reads jobs, a line of JSON each, and answers each with a line.
Every job is a process of its own, so that its peak memory is its own.
"""

import importlib.util
import json
import multiprocessing
import resource
import sys
import time
import warnings

import numpy as np

CELL_POINTS = 60  # pyacvd clusters vertices: so many for each cluster, as its manual asks for a dense mesh
TRIES, NEAR = 3, 0.03  # of edge lengths, until the number of vertices is near enough


def pyacvd(vertices, faces, count):
    """Approximated centroidal Voronoi clusters of the vertices, after subdivision."""
    import pyacvd as acvd  # noqa: PLC0415
    import pyvista  # noqa: PLC0415

    began = time.perf_counter()
    triangles = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    clustering = acvd.Clustering(pyvista.PolyData(vertices, triangles))
    while clustering.mesh.n_points < CELL_POINTS * count:
        clustering.subdivide(2)
    clustering.cluster(count)
    mesh = clustering.create_mesh()
    seconds = time.perf_counter() - began
    return np.asarray(mesh.points, np.float64), np.asarray(mesh.regular_faces, np.int64), seconds


def pymeshlab(vertices, faces, count):
    """Incremental isotropic remeshing; the time is that of the last edge length tried."""
    import pymeshlab as lab  # noqa: PLC0415

    def remesh(length):
        meshes = lab.MeshSet()
        meshes.add_mesh(lab.Mesh(vertices, faces))
        meshes.meshing_isotropic_explicit_remeshing(iterations=10, targetlen=lab.PureValue(length))
        return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()

    return _of_count(remesh, vertices, faces, count)


def gpytoolbox(vertices, faces, count):
    """Botsch and Kobbelt's incremental remeshing; the time is that of the last edge length tried."""
    from gpytoolbox import remesh_botsch  # noqa: PLC0415

    def remesh(length):
        return remesh_botsch(vertices.copy(), faces.astype(np.int32), 10, length, True)

    return _of_count(remesh, vertices, faces, count)


def _of_count(remesh, vertices, faces, count):
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    length = np.sqrt(2 * area / (np.sqrt(3) * count))
    for _ in range(TRIES):
        began = time.perf_counter()
        found = remesh(length)
        seconds = time.perf_counter() - began
        if abs(len(found[0]) / count - 1) <= NEAR:
            break
        length *= np.sqrt(len(found[0]) / count)
    return np.asarray(found[0], np.float64), np.asarray(found[1], np.int64), seconds


TOOLS = {tool.__name__: tool for tool in (pyacvd, pymeshlab, gpytoolbox)}


def work(job, answer):
    """One job, in a process of its own."""
    warnings.simplefilter("ignore")
    mesh = np.load(job["input"])
    try:
        vertices, faces, seconds = TOOLS[job["tool"]](mesh["vertices"], mesh["faces"], job["count"])
    except Exception as error:  # whatever a peer raises is its result
        answer.send({"error": f"{type(error).__name__}: {error}"})
        return
    np.savez(job["output"], vertices=vertices, faces=faces)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    answer.send({"seconds": seconds, "peak_memory_mb": memory})


def main() -> None:
    """Until there are no more jobs."""
    print(json.dumps([name for name in TOOLS if importlib.util.find_spec(name)]), flush=True)
    fork = multiprocessing.get_context("fork")
    for line in sys.stdin:
        here, there = fork.Pipe(duplex=False)
        process = fork.Process(target=work, args=(json.loads(line), there))
        process.start()
        there.close()
        try:
            answer = here.recv()
        except EOFError:
            answer = {"error": "the process ended"}
        process.join()
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
