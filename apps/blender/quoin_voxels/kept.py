"""Stores voxels with their meshes in the .blend, so that export can write them unchanged."""

import json
import zlib
from typing import Any, NamedTuple

import numpy as np

from . import quoin

_VOXELS, _ABOUT, _TEXELS, _STATES = "quoin_voxels", "quoin_about", "quoin_texels", "quoin_states"
MOST_CELLS = 1 << 29
# Memory grows with the cells of the bounding box. Boxes with more than FREE_CELLS must have at least one voxel per
# MOST_CELLS_A_VOXEL cells.
FREE_CELLS, MOST_CELLS_A_VOXEL = 1 << 24, 256
_SLICE = 1 << 22  # cells at once


def _packed_states(grid):
    """Returns the compressed states of a grid's voxels, or None if all are 0."""
    packer, packed, has_states = zlib.compressobj(1), [], False
    x, y, z = grid.shape
    step = max(1, _SLICE // max(1, y * z))
    for first in range(0, x, step):
        start = (grid.origin[0] + first, *grid.origin[1:])
        states = grid.states(start, (min(step, x - first), y, z))
        has_states = has_states or bool(states.any())
        packed.append(packer.compress(states.tobytes()))
    return b"".join([*packed, packer.flush()]) if has_states else None


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


class Form(NamedTuple):
    """The parts of a type that its properties do not contain."""

    faces: Any = None  #: six textured faces, or None
    shapes: Any = None  #: quoin.Shapes, or None
    orientations: Any = None  #: quoin.Orientations, or None


class _Images:
    """Numbers images: bytes, each once."""

    def __init__(self):
        self.numbers, self.all = {}, []

    def pack(self, face):
        """Returns a face for JSON."""
        number = -1  # a colour
        if face.image is not None:
            texels = face.image.tobytes()
            number = self.numbers.setdefault(texels, len(self.all))
            if number == len(self.all):
                self.all.append(texels)
        return [number, *face[1:6], face.emission_share]


def _pack_element(one, images):
    looks = {name: {"face": images.pack(look)} if isinstance(look, quoin.Face) else look
             for name, look in one.looks.items()}
    return {**one._asdict(), "looks": looks, "parts": dict(one.parts)}


def _pack_shapes(shapes, images):
    parts = [{"elements": [_pack_element(each, images) for each in one.elements], "orientation": one.orientation,
              "when": one.when} for one in shapes.parts]
    return {**shapes._asdict(), "parts": parts}  # `fluid` becomes a list


def _pack_forms(forms):
    """Returns the forms of types for JSON, and their images."""
    images, found = _Images(), []
    for one in forms:
        packed = {}
        if one.faces is not None:
            packed["faces"] = [images.pack(face) for face in one.faces]
        if one.shapes is not None:
            packed["shapes"] = _pack_shapes(one.shapes, images)
        if one.orientations is not None:
            packed["orientations"] = one.orientations
        found.append(packed)
    return found, images.all


def _tuples(value):
    """Converts the lists of JSON to tuples."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _unpack_face(row, images):
    share = row[6] if len(row) > 6 else 255  # absent in older files
    return quoin.Face(images[row[0]] if row[0] >= 0 else None, row[1], row[2], row[3], tuple(row[4]), row[5],
                      emission_share=share)


def _unpack_look(look, images):
    if isinstance(look, dict):
        return _unpack_face(look["face"], images)
    return _tuples(look)


def _unpack_element(one, images):
    turn = None if one["turn"] is None else quoin.Turn(*_tuples(one["turn"]))
    looks = {name: _unpack_look(look, images) for name, look in one["looks"].items()}
    parts = {name: tuple(part) for name, part in one["parts"].items()}
    return quoin.Element(tuple(one["min"]), tuple(one["max"]), turn, looks, parts, one["collides"])


def _unpack_shapes(shapes, images):
    parts = tuple(quoin.ShapePart(tuple(_unpack_element(each, images) for each in one["elements"]), one["orientation"],
                                  tuple(quoin.Condition(*_tuples(each)) for each in one["when"]))
                  for one in shapes["parts"])
    fluid = shapes.get("fluid")  # absent in older files
    if fluid is not None:
        fluid = quoin.Fluid(fluid[0], tuple(quoin.Condition(*_tuples(each)) for each in fluid[1]))
    return quoin.Shapes(**{**shapes, "parts": parts, "fluid": fluid})


def _unpack_forms(found, sizes, packed):
    """Returns the forms that `_pack_forms` was given."""
    data, images, at = np.frombuffer(zlib.decompress(packed), np.uint8), [], 0
    for size in sizes:
        images.append(data[at : at + 4 * size * size].reshape(size, size, 4))
        at += 4 * size * size
    return [Form(tuple(_unpack_face(row, images) for row in one["faces"]) if "faces" in one else None,
                 _unpack_shapes(one["shapes"], images) if "shapes" in one else None,
                 quoin.Orientations(*_tuples(one["orientations"])) if "orientations" in one else None) for one in found]


def keep(mesh, grid, types, scale, slots, forms):
    """Stores a grid's voxels in its mesh. `slots` maps types with their own material to its slot; `forms` has the form
    of each type. Returns False and does nothing if there are too many voxels or they are too scattered."""
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
    if any(forms[i] != Form() for i in occurs):
        about["forms"], images = _pack_forms([forms[i] for i in occurs])
        about["images"] = [int(np.sqrt(len(one) // 4)) for one in images]
        mesh[_TEXELS] = zlib.compress(b"".join(images))
    if any(types[i].state_bits for i in occurs) and (states := _packed_states(grid)) is not None:
        mesh[_STATES] = states
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
        self.forms = [Form()] * len(self.types)
        packed = about.get("forms")
        if "faces" in about:  # stored before types had shapes
            packed = [{} if six is None else {"faces": six} for six in about["faces"]]
        if packed is not None:
            self.forms = _unpack_forms(packed, about["images"], mesh[_TEXELS])
        self.states = None  # of the voxels; None: all 0
        if _STATES in mesh:
            self.states = np.frombuffer(zlib.decompress(mesh[_STATES]), np.uint32).reshape(about["shape"])


def is_kept(mesh):
    """Returns true if a mesh has stored voxels and its shape is unedited."""
    return _VOXELS in mesh and _ABOUT in mesh and json.loads(mesh[_ABOUT])["fingerprint"] == fingerprint(mesh)
