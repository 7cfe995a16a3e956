"""Stores voxels with their meshes in the .blend, so that export can write them unchanged."""

import json
import zlib

import numpy as np

from . import quoin

_VOXELS, _ABOUT, _TEXELS = "quoin_voxels", "quoin_about", "quoin_texels"
MOST_CELLS = 1 << 29
# Memory grows with the cells of the bounding box. Boxes with more than FREE_CELLS must have at least one voxel per
# MOST_CELLS_A_VOXEL cells.
FREE_CELLS, MOST_CELLS_A_VOXEL = 1 << 24, 256
_SLICE = 1 << 22  # cells at once


def _read(items, name, width, dtype):
    values = np.empty(len(items) * width, dtype)
    items.foreach_get(name, values)
    return values.tobytes()


def fingerprint(mesh):
    """Returns a hash of a mesh's shape. It changes if vertices, face corners or face materials are edited."""
    parts = [_read(mesh.vertices, "co", 3, np.float32), _read(mesh.loops, "vertex_index", 1, np.int32),
             _read(mesh.polygons, "loop_total", 1, np.int32), _read(mesh.polygons, "material_index", 1, np.int32)]
    return f"{len(mesh.polygons)} " + " ".join(f"{zlib.crc32(one):08x}" for one in parts)


def _slices(voxels):
    step = max(1, _SLICE // max(1, voxels[:1].size))
    return [voxels[x : x + step] for x in range(0, len(voxels), step)]


def _pack_faces(faces):
    """Returns the textured faces of types for JSON, and their images: bytes, each once."""
    numbers, images, found = {}, [], []
    for six in faces:
        rows = None
        if six is not None:
            rows = []
            for one in six:
                texels = one.image.tobytes()
                if texels not in numbers:
                    numbers[texels] = len(images)
                    images.append(texels)
                rows.append([numbers[texels], *one[1:6]])
        found.append(rows)
    return found, images


def _unpack_faces(found, sizes, packed):
    """Returns what `_pack_faces` was given, with faces of None for types without textures."""
    data, images, at = np.frombuffer(zlib.decompress(packed), np.uint8), [], 0
    for size in sizes:
        images.append(data[at : at + 4 * size * size].reshape(size, size, 4))
        at += 4 * size * size
    return [None if six is None else tuple(quoin.Face(images[row[0]], row[1], row[2], row[3], tuple(row[4]), row[5])
                                           for row in six) for six in found]


def keep(mesh, grid, types, scale, slots, faces):
    """Stores a grid's voxels in its mesh. `slots` maps types with their own material to its slot; `faces` has the
    textured faces of each type, or None. Returns False and does nothing if there are too many voxels or they are too
    scattered."""
    cells = int(np.prod(grid.shape, dtype=np.int64))
    if cells > min(MOST_CELLS, max(FREE_CELLS, MOST_CELLS_A_VOXEL * grid.voxel_count)):
        return False
    voxels = grid.to_numpy()
    counts = sum(np.bincount(one.ravel(), minlength=len(types)) for one in _slices(voxels))
    occurs = np.flatnonzero(counts)
    occurs = occurs[occurs > 0]
    small = np.zeros(int(occurs.max()) + 1, np.uint8 if len(occurs) < 256 else np.uint16)
    small[occurs] = np.arange(1, len(occurs) + 1)
    about = {"shape": voxels.shape, "origin": grid.origin, "scale": scale, "bytes": small.itemsize,
             "fingerprint": fingerprint(mesh), "types": [list(types[i]) for i in occurs],
             "slots": [slots.get(int(i), -1) for i in occurs]}
    if any(faces[i] is not None for i in occurs):
        about["faces"], images = _pack_faces([faces[i] for i in occurs])
        about["images"] = [int(np.sqrt(len(one) // 4)) for one in images]
        mesh[_TEXELS] = zlib.compress(b"".join(images))
    packer = zlib.compressobj(1)
    mesh[_VOXELS] = b"".join([packer.compress(small[one].tobytes()) for one in _slices(voxels)] + [packer.flush()])
    mesh[_ABOUT] = json.dumps(about)
    return True


def scale_of(mesh):
    """Returns the voxel size of a mesh, in Blender units."""
    return json.loads(mesh[_ABOUT])["scale"]


class Kept:
    """The voxels [x, y, z] stored in a mesh: 0 is air; others number `types` from 1."""

    def __init__(self, mesh):
        about = json.loads(mesh[_ABOUT])
        data = np.frombuffer(zlib.decompress(mesh[_VOXELS]), np.uint8 if about["bytes"] == 1 else np.uint16)
        self.voxels = data.reshape(about["shape"])
        self.origin = tuple(about["origin"])
        self.slots = about["slots"]  # material slot of each type; -1: none of its own
        self.types = [quoin.VoxelType(tuple(one[0]), *one[1:]) for one in about["types"]]
        self.faces = [None] * len(self.types)  # textures of each type
        if "faces" in about:
            self.faces = _unpack_faces(about["faces"], about["images"], mesh[_TEXELS])


def is_kept(mesh):
    """Returns true if a mesh has stored voxels and its shape is unedited."""
    return _VOXELS in mesh and _ABOUT in mesh and json.loads(mesh[_ABOUT])["fingerprint"] == fingerprint(mesh)
