"""Compares Quoin with other Python packages in one process. Usage: peers.py [FILE.vox] [--edge N] [--turns N]

Runs the installed ones of scikit-image, zmesh, trimesh and py-vox-io, and lists the missing ones. Each pair is checked
to do the same before it is timed: times are the least of some turns, by turns. `numpy`, and `quoin` on the path, are
needed.
"""

import argparse
import importlib
import os
import platform
import sys
import time

try:
    import numpy as np
except ImportError:
    print("NumPy is missing")
    sys.exit(77)

import quoin


class Pair:
    """A task for Quoin and a peer."""

    def __init__(self, task, package, ours, theirs, check):
        self.task, self.package, self.ours, self.theirs, self.check = task, package, ours, theirs, check


def package(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def volume_of(points, triangles):
    a, b, c = (points[triangles[:, i]].astype(np.float64) for i in range(3))
    return abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def close(a, b, share):
    if abs(a - b) > share * max(abs(a), abs(b)):
        raise SystemExit(f"the results differ: {a} and {b}")


def ball(edge):
    x, y, z = np.indices((edge,) * 3, np.float32) - (edge - 1) / 2
    return np.sqrt(x * x + y * y + z * z), 0.39 * edge


def surfaces(edge):
    measure = package("skimage.measure")
    if measure is None:
        return
    field, radius = ball(edge)
    def theirs():
        return measure.marching_cubes(field, radius, gradient_direction="ascent")
    for threads, name in ((1, "one thread"), (0, "all threads")):
        def ours(threads=threads):
            return quoin.surface_nets(field, radius, solid="below", threads=threads)
        def check(ours=ours):
            mesh, found = ours(), theirs()
            close(volume_of(mesh.positions, mesh.triangles), volume_of(found[0], found[1]), 0.01)
        yield Pair(f"surface of {edge}^3 floats, {name}", "scikit-image, marching cubes", ours, theirs, check)


def labels(edge):
    zmesh = package("zmesh")
    if zmesh is None:
        return
    rng = np.random.default_rng(3)
    seeds = rng.uniform(0, edge, (40, 3))
    points = np.stack(np.indices((edge,) * 3), -1)
    array = np.zeros((edge,) * 3, np.uint32)
    least = np.full((edge,) * 3, np.inf)
    for label, seed in enumerate(seeds, 1):
        distance = ((points - seed) ** 2).sum(-1)
        array[distance < least] = label
        least = np.minimum(least, distance)
    def theirs():
        mesher = zmesh.Mesher((1, 1, 1))
        mesher.mesh(array)
        return [mesher.get(label, normals=False) for label in mesher.ids()]
    def ours():
        mesh = quoin.mesh_labels(array, threads=1)
        return [mesh.of_label(label) for label in range(1, 41)]
    def check():
        mesh = quoin.mesh_labels(array)
        total = sum(volume_of(mesh.positions, mesh.of_label(label)) for label in range(1, 41))
        close(total, sum(volume_of(one.vertices, one.faces) for one in theirs()), 0.1)
    yield Pair(f"40 labels in {edge}^3, one thread", "zmesh", ours, theirs, check)


def files(path):
    if package("pyvox") is None or path is None:
        return
    from pyvox.parser import VoxParser

    def theirs():
        return [model.voxels for model in VoxParser(path).parse().models]
    def ours():
        return [grid.to_numpy() for grid in quoin.load(path).grids]
    try:
        theirs()
    except Exception as error:  # any error of the peer
        print(f"py-vox-io does not read {os.path.basename(path)}: {error}")
        return
    def check():
        close(sum(int(np.count_nonzero(one)) for one in ours()), sum(len(one) for one in theirs()), 0)
    yield Pair(f"{os.path.basename(path)} as arrays", "py-vox-io", ours, theirs, check)


def blocks(edge):
    trimesh = package("trimesh")
    if trimesh is None or package("scipy") is None:
        return
    field, radius = ball(edge // 2)
    array = (field < radius).astype(np.uint8)
    def theirs():
        return trimesh.voxel.VoxelGrid(array.astype(bool)).as_boxes()
    def ours():
        return quoin.from_numpy(array, [(200, 200, 200)]).grids[0].mesh()
    def check():
        mesh = ours()
        close(volume_of(mesh.positions, mesh.triangles), float(array.sum()), 1e-6)
        close(float(theirs().volume), float(array.sum()), 1e-6)
    yield Pair(f"cubes of {edge // 2}^3 voxels as a mesh", "trimesh, as_boxes", ours, theirs, check)

    surface = quoin.surface_nets(*ball(edge // 2), solid="below")
    mesh = surface.to_trimesh()
    def their_voxels():
        return mesh.voxelized(1.0).fill()
    def our_voxels():
        return quoin.Scene().voxelize(surface.positions, surface.triangles, threads=1)
    def check_voxels():
        close(our_voxels().voxel_count, int(their_voxels().filled_count), 0.1)
    yield Pair(f"{len(surface.triangles)} triangles as voxels, one thread", "trimesh, voxelized().fill()", our_voxels,
               their_voxels, check_voxels)


def least(work, turns):
    found = []
    for _ in range(turns):
        begin = time.perf_counter()
        work()
        found.append(time.perf_counter() - begin)
    return found


def main():
    options = argparse.ArgumentParser()
    options.add_argument("file", nargs="?", help="a .vox file to read")
    options.add_argument("--edge", type=int, default=192)
    options.add_argument("--turns", type=int, default=5)
    given = options.parse_args()
    names = {"skimage": "scikit-image", "zmesh": "zmesh", "trimesh": "trimesh", "pyvox": "py-vox-io"}
    missing = [shown for name, shown in names.items() if package(name) is None]
    print(f"Quoin {quoin.version()}, NumPy {np.__version__}, Python {platform.python_version()}, "
          f"{os.cpu_count()} processors")
    print("not installed: " + ", ".join(missing) if missing else "all peers are installed")
    pairs = [*surfaces(given.edge), *labels(given.edge // 2), *files(given.file), *blocks(given.edge)]
    if not pairs:
        print("there is nothing to compare with")
        sys.exit(77)
    print("| task | Quoin, ms | peer, ms | times | peer |\n|---|---|---|---|---|")
    for pair in pairs:
        pair.check()
        ours, theirs = [], []
        for _ in range(given.turns):  # alternating, to average out other processes
            ours += least(pair.ours, 1)
            theirs += least(pair.theirs, 1)
        print(f"| {pair.task} | {1000 * min(ours):.1f} | {1000 * min(theirs):.1f} | {min(theirs) / min(ours):.1f} "
              f"| {pair.package} |")


if __name__ == "__main__":
    main()
