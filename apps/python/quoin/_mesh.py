"""Meshes, and functions that mesh arrays."""

from __future__ import annotations

import ctypes
from typing import Any, Optional, Sequence, Tuple

import numpy as np

from . import _c
from ._c import NdArray


class Mesh:
    """A triangle mesh. Its arrays are read-only views of the library's memory. An array stays valid without the mesh.

    Positions of a grid's mesh are in the grid's voxels. Positions of an array's mesh use its `spacing` and `origin`.

    >>> mesh = surface_nets(np.indices((9, 9, 9)).sum(0).astype(np.float32), 12.0)
    >>> mesh.positions.flags.owndata, mesh.positions.flags.writeable
    (False, False)
    >>> bool(np.isclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-3).all())
    True
    """

    positions: NdArray  #: float32, (vertices, 3)
    triangles: NdArray  #: uint32, (triangles, 3): rows of `positions`, counter-clockwise seen from outside
    normals: Optional[NdArray]  #: float32, (vertices, 3), of unit length; None for labels
    colours: Optional[NdArray]  #: uint8, (vertices, 4), sRGB without occlusion; only for grids
    occlusion: Optional[NdArray]  #: float32, (vertices,), 0 open to 1 dark; only for grids
    types: Optional[NdArray]  #: uint16, (vertices,), voxel types; only for blocks; 0: a field's surface
    #: uint32, (vertices,), numbers in `Textures`, 2**32 - 1: none; only for blocks of scenes with textures or shapes
    textures: Optional[NdArray]
    #: float32, (vertices, 2), with `textures`: rightwards and downwards, 1 per voxel; the texture repeats
    texture_uvs: Optional[NdArray]
    tints: Optional[NdArray]  #: uint8, (vertices, 4), with `textures`: sRGB, multiplies the texture in linear light
    #: uint8, (vertices,), with `textures`: the face's share of its type's emission, in 255ths
    emission_shares: Optional[NdArray]
    interfaces: Optional[NdArray]  #: int64, (n, 4); only for labels; see `mesh_labels`

    def __init__(self, owner: _c.Owner) -> None:
        data = _c.sized(_c.MeshData)
        _c.check(_c.lib.quoin_mesh_view(owner.handle, ctypes.byref(data)))
        self._owner = owner
        n = data.vertex_count

        def view(pointer: Any, shape: Tuple[int, ...], dtype: Any) -> Optional[NdArray]:
            return _c.view_of(owner, pointer, shape, np.dtype(dtype))

        empty = np.zeros((0, 3), np.float32)
        found = view(data.positions, (n, 3), np.float32)
        self.positions = empty if found is None else found
        found = view(data.indices, (data.index_count // 3, 3), np.uint32)
        self.triangles = empty.astype(np.uint32) if found is None else found
        self.normals = view(data.normals, (n, 3), np.float32)
        self.colours = view(data.colours, (n, 4), np.uint8)
        self.occlusion = view(data.occlusion, (n,), np.float32)
        self.types = view(data.types, (n,), np.uint16)
        self.textures = view(data.textures, (n,), np.uint32)
        self.texture_uvs = view(data.texture_uvs, (n, 2), np.float32)
        self.tints = view(data.tints, (n, 4), np.uint8)
        self.emission_shares = view(data.emission_shares, (n,), np.uint8)
        self.interfaces = view(data.interfaces, (data.interface_count, 4), np.int64)

    def __repr__(self) -> str:
        return f"<quoin.Mesh: {len(self.positions)} vertices, {len(self.triangles)} triangles>"

    def of_label(self, label: int) -> NdArray:
        """Returns the closed surface of a label: uint32, (n, 3), rows of `positions`, facing outwards. It has no
        triangles if the label is absent. Raises ValueError for meshes that `mesh_labels` did not make.

        >>> array = np.zeros((4, 4, 4), np.uint8); array[1:3, 1:3, 1:3] = 7
        >>> len(mesh_labels(array).of_label(7)) == len(mesh_labels(array).triangles)
        True
        """
        if self.interfaces is None:
            raise ValueError("the mesh has no labels; use mesh_labels")
        parts = [np.zeros((0, 3), np.uint32)]
        for back, front, first, count in self.interfaces:
            triangles = self.triangles[first // 3 : (first + count) // 3]
            if back == label:
                parts.append(triangles)
            elif front == label:
                parts.append(triangles[:, ::-1])
        return np.concatenate(parts)

    def to_trimesh(self) -> Any:
        """Copies the mesh to a trimesh.Trimesh. Raises ImportError if the package trimesh is missing."""
        import trimesh

        return trimesh.Trimesh(self.positions, self.triangles.astype(np.int64), vertex_normals=self.normals,
                               vertex_colors=self.colours, process=False)


def surface_nets(array: NdArray, iso: float, spacing: Sequence[float] = (1, 1, 1),
                 origin: Sequence[float] = (0, 0, 0), solid: str = "above", threads: int = 0) -> Mesh:
    """Meshes the surface where the values of an array equal `iso`.

    `array`: (nx, ny, nz), integers up to 64 bits, float32, float64 or bool, in native byte order. It may have any
    strides and is read in place. `spacing`: distance between samples along each axis. `origin`: position of sample
    [0, 0, 0]. `solid`: "above" if values above `iso` are solid (scans), "below" if values below are (signed distances).

    Raises TypeError for an unsupported dtype, ValueError for a wrong shape or an empty axis, and
    QuoinError if `iso` is NaN or the spacing or origin is invalid.

    >>> x, y, z = np.mgrid[-8:9, -8:9, -8:9]
    >>> ball = surface_nets(np.sqrt(x * x + y * y + z * z), 6.0, origin=(-8, -8, -8), solid="below")
    >>> bool(np.allclose(np.linalg.norm(ball.positions, axis=1), 6.0, atol=0.2))
    True
    """
    if solid not in ("above", "below"):
        raise ValueError('solid must be "above" or "below"')
    given = _c.array_of(array, spacing, origin)
    out = ctypes.c_uint64()
    _c.check(_c.lib.quoin_surface_nets(ctypes.byref(given), _c.number(iso, "iso"), int(solid == "below"),
                                       _c.whole(threads, "threads"), ctypes.byref(out)))
    return Mesh(_c.Owner(out.value))


def mesh_labels(array: NdArray, background: int = 0, spacing: Sequence[float] = (1, 1, 1),
                origin: Sequence[float] = (0, 0, 0), relaxation_steps: int = 4, threads: int = 0) -> Mesh:
    """Meshes the surfaces between the labels of a segmentation, as one mesh. Neighbouring labels share triangles.

    `array`: (nx, ny, nz), integers or bool, in native byte order. It may have any strides and is read in place.
    `background`: label of empty space, also outside the array. `spacing`, `origin`: as in `surface_nets`.
    `relaxation_steps`: smoothing steps, 0 to 1,000.

    Each row of `Mesh.interfaces` describes the triangles between two labels: back label, front label, first index and
    index count, in `mesh.triangles.ravel()`. The background is never the back label. `Mesh.of_label` returns the
    triangles of one label. Raises errors like `surface_nets`, and QuoinError for arrays of floats.
    """
    given = _c.array_of(array, spacing, origin)
    out = ctypes.c_uint64()
    _c.check(_c.lib.quoin_mesh_labels(ctypes.byref(given), _c.whole(background, "background", -2**63, 2**63 - 1),
                                      _c.whole(relaxation_steps, "relaxation_steps"), _c.whole(threads, "threads"),
                                      ctypes.byref(out)))
    return Mesh(_c.Owner(out.value))
