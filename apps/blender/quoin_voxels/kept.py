"""Voxels that meshes carry in the .blend, so that what was imported can be written as it was."""

import json
import zlib

import numpy as np

from . import quoin

_VOXELS, _ABOUT = "quoin_voxels", "quoin_about"
MOST_CELLS = 1 << 29


def fingerprint(mesh):
    """Of a mesh's shape: other when its points, or its faces' materials, are edited."""
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    return f"{len(mesh.polygons)} {zlib.crc32(points.tobytes()):08x}"


def keep(mesh, grid, types, scale, slots):
    """Puts a grid's voxels into its mesh. `slots`: of types that have a material of their own, which. Returns False, and
    does nothing, where the voxels are too many."""
    if int(np.prod(grid.shape, dtype=np.int64)) > MOST_CELLS:
        return False
    voxels = grid.to_numpy()
    occurs = np.flatnonzero(np.bincount(voxels.ravel(), minlength=1))
    occurs = occurs[occurs > 0]
    small = np.zeros(int(occurs.max()) + 1, np.uint8 if len(occurs) < 256 else np.uint16)
    small[occurs] = np.arange(1, len(occurs) + 1)
    voxels = small[voxels]
    about = {"shape": voxels.shape, "origin": grid.origin, "scale": scale, "bytes": voxels.itemsize,
             "fingerprint": fingerprint(mesh), "types": [list(types[i]) for i in occurs],
             "slots": [slots.get(int(i), -1) for i in occurs]}
    mesh[_VOXELS] = zlib.compress(voxels.tobytes(), 1)
    mesh[_ABOUT] = json.dumps(about)
    return True


def scale_of(mesh):
    """Blender's units a voxel of it."""
    return json.loads(mesh[_ABOUT])["scale"]


class Kept:
    """The voxels [x, y, z] of a mesh, by numbers of `types` from 1 on."""

    def __init__(self, mesh):
        about = json.loads(mesh[_ABOUT])
        data = np.frombuffer(zlib.decompress(mesh[_VOXELS]), np.uint8 if about["bytes"] == 1 else np.uint16)
        self.voxels = data.reshape(about["shape"])
        self.origin = tuple(about["origin"])
        self.slots = about["slots"]  # of materials, a type each; -1 where it has none
        self.types = [quoin.VoxelType(tuple(one[0]), *one[1:]) for one in about["types"]]


def is_kept(mesh):
    """Whether a mesh has voxels, and still their shape."""
    return _VOXELS in mesh and _ABOUT in mesh and json.loads(mesh[_ABOUT])["fingerprint"] == fingerprint(mesh)
