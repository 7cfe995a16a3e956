"""Quoin: voxels as files, NumPy arrays, meshes and pictures.

>>> import numpy as np, quoin
>>> array = np.zeros((8, 4, 8), np.uint8)      # x, y (up), z
>>> array[:, 0, :] = 1
>>> array[3:5, 1:3, 3:5] = 2
>>> scene = quoin.from_numpy(array, [(110, 160, 80), (180, 60, 40)])
>>> scene.grids[0].shape
(8, 3, 8)
>>> bool((scene.grids[0].to_numpy() == array[:, :3]).all())
True
>>> mesh = scene.grids[0].mesh()
>>> mesh.triangles.shape[1], mesh.positions.dtype
(3, dtype('float32'))
>>> scene.render(64, 48).shape
(48, 64, 3)

Arrays of voxels have the axes x, y (up) and z, in this order. Calls that take long release Python's lock.
"""

from __future__ import annotations

import ctypes
import os
from typing import Any, Iterable, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _c
from ._c import QuoinError

__all__ = ["Grid", "Hits", "Mesh", "QuoinError", "Scene", "VoxelType", "from_numpy", "load", "mesh_labels",
           "surface_nets", "version"]

Path = Union[str, "os.PathLike[str]"]
Colour = Sequence[int]


class VoxelType(NamedTuple):
    """A kind of voxel. `rgba` is sRGB, 0 to 255; an alpha below 255 makes it transparent."""

    rgba: Tuple[int, int, int, int]
    name: str = ""
    emission: float = 0.0
    metalness: float = 0.0
    roughness: float = 1.0


class Hits(NamedTuple):
    """What rays met, an entry a ray. `t` is infinite where nothing was."""

    t: np.ndarray
    voxel: np.ndarray
    type: np.ndarray
    normal: np.ndarray


class _Owner:
    # A handle of the library, freed with the last Python object that uses it.
    def __init__(self, handle: int) -> None:
        self.handle = handle

    def __del__(self) -> None:
        if self.handle:
            _c.lib.quoin_free(self.handle)
            self.handle = 0


def version() -> str:
    """The library's version.

    >>> version().count(".")
    2
    """
    return _c.lib.quoin_version().decode()


class Mesh:
    """Triangles. Its arrays are views of the library's own memory, read-only, and keep it alive.

    >>> mesh = surface_nets(np.indices((9, 9, 9)).sum(0).astype(np.float32), 12.0)
    >>> mesh.positions.flags.owndata, mesh.positions.flags.writeable
    (False, False)
    >>> bool(np.isclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-3).all())
    True
    """

    positions: np.ndarray  #: float32, (vertices, 3)
    triangles: np.ndarray  #: uint32, (triangles, 3), counter-clockwise from outside
    normals: Optional[np.ndarray]  #: float32, (vertices, 3); of labels none
    colours: Optional[np.ndarray]  #: uint8, (vertices, 4), sRGB; of grids alone
    occlusion: Optional[np.ndarray]  #: float32, (vertices,), 0 open to 1 dark; of grids alone
    interfaces: Optional[np.ndarray]  #: int64, (n, 4): back and front label, first index, count; of labels alone

    def __init__(self, owner: _Owner) -> None:
        data = _c.sized(_c.MeshData)
        _c.check(_c.lib.quoin_mesh_view(owner.handle, ctypes.byref(data)))
        self._owner = owner
        n = data.vertex_count

        def view(pointer: Any, shape: Tuple[int, ...], dtype: Any) -> Optional[np.ndarray]:
            return _c.view_of(owner, pointer, shape, np.dtype(dtype))

        empty = np.zeros((0, 3), np.float32)
        found = view(data.positions, (n, 3), np.float32)
        self.positions = empty if found is None else found
        found = view(data.indices, (data.index_count // 3, 3), np.uint32)
        self.triangles = empty.astype(np.uint32) if found is None else found
        self.normals = view(data.normals, (n, 3), np.float32)
        self.colours = view(data.colours, (n, 4), np.uint8)
        self.occlusion = view(data.occlusion, (n,), np.float32)
        self.interfaces = view(data.interfaces, (data.interface_count, 4), np.int64)

    def __repr__(self) -> str:
        return f"<quoin.Mesh: {len(self.positions)} vertices, {len(self.triangles)} triangles>"

    def of_label(self, label: int) -> np.ndarray:
        """The triangles around one label, turned outwards: indices into `positions`.

        >>> array = np.zeros((4, 4, 4), np.uint8); array[1:3, 1:3, 1:3] = 7
        >>> len(mesh_labels(array).of_label(7)) == len(mesh_labels(array).triangles)
        True
        """
        if self.interfaces is None:
            raise ValueError("only meshes of labels have labels")
        parts = [np.zeros((0, 3), np.uint32)]
        for back, front, first, count in self.interfaces:
            triangles = self.triangles[first // 3 : (first + count) // 3]
            if back == label:
                parts.append(triangles)
            elif front == label:
                parts.append(triangles[:, ::-1])
        return np.concatenate(parts)

    def to_trimesh(self) -> Any:
        """A trimesh.Trimesh of copies. Needs the package trimesh."""
        import trimesh

        return trimesh.Trimesh(self.positions, self.triangles.astype(np.int64), vertex_normals=self.normals,
                               vertex_colors=self.colours, process=False)


class Grid:
    """A grid of a scene: voxels, or the field of a volume."""

    def __init__(self, scene: "Scene", number: int) -> None:
        self._scene = scene
        self._number = number

    def _info(self) -> Any:
        info = _c.sized(_c.GridInfo)
        _c.check(_c.lib.quoin_grid_get_info(self._scene._owner.handle, self._number, ctypes.byref(info)))
        return info

    @property
    def name(self) -> str:
        return self._info().name.decode("utf-8", "replace")

    @property
    def voxels(self) -> int:
        """How many voxels are not air."""
        return int(self._info().voxels)

    @property
    def origin(self) -> Tuple[int, int, int]:
        """The least voxel of the tight box around its voxels."""
        return tuple(self._info().min)

    @property
    def shape(self) -> Tuple[int, int, int]:
        """Voxels of that box along x, y and z."""
        return tuple(self._info().extent)

    def to_numpy(self, origin: Optional[Sequence[int]] = None, shape: Optional[Sequence[int]] = None) -> np.ndarray:
        """The types of its voxels as uint16 [x, y, z]: of the tight box around them, or of the box that is given."""
        info = self._info()
        at = [int(v) for v in (info.min if origin is None else origin)]
        extent = [int(v) for v in (info.extent if shape is None else shape)]
        if len(at) != 3 or len(extent) != 3 or min(extent) < 0:
            raise ValueError("origin and shape are three whole numbers")
        out = np.zeros(extent, np.uint16)
        three = ctypes.c_int32 * 3
        _c.check(_c.lib.quoin_grid_read(self._scene._owner.handle, self._number, three(*at), three(*extent),
                                        out.ctypes.data, out.size))
        return out

    def mesh(self, smooth: bool = False, occlusion: bool = True, threads: int = 0) -> Mesh:
        """Its surface: merged faces of blocks, or a smooth one around them."""
        options = _c.sized(_c.MeshOptions)
        options.smooth, options.no_occlusion, options.threads = int(smooth), int(not occlusion), threads
        out = ctypes.c_uint64()
        _c.check(_c.lib.quoin_grid_mesh(self._scene._owner.handle, self._number, ctypes.byref(options),
                                        ctypes.byref(out)))
        return Mesh(_Owner(out.value))

    def __repr__(self) -> str:
        return f"<quoin.Grid {self.name!r}: {self.voxels} voxels, {'x'.join(map(str, self.shape))}>"


class Scene:
    """Grids and their types; an empty one, unless `load` or `from_numpy` made it."""

    def __init__(self, _owner: Optional[_Owner] = None) -> None:
        if _owner is None:
            out = ctypes.c_uint64()
            _c.check(_c.lib.quoin_scene_create(ctypes.byref(out)))
            _owner = _Owner(out.value)
        self._owner = _owner

    def _count(self, function: Any) -> int:
        out = ctypes.c_size_t()
        _c.check(function(self._owner.handle, ctypes.byref(out)))
        return out.value

    @property
    def grids(self) -> List[Grid]:
        return [Grid(self, i) for i in range(self._count(_c.lib.quoin_grid_count))]

    @property
    def types(self) -> List[VoxelType]:
        """All types; the first is air."""
        found = []
        for i in range(self._count(_c.lib.quoin_type_count)):
            one = _c.sized(_c.Type)
            _c.check(_c.lib.quoin_type_get(self._owner.handle, i, ctypes.byref(one)))
            found.append(VoxelType(tuple(one.rgba), one.name.decode("utf-8", "replace"), one.emission, one.metalness,
                                   one.roughness))
        return found

    @property
    def palette(self) -> np.ndarray:
        """The types' colours, uint8 (types, 4): `palette[grid.to_numpy()]` is a picture of its voxels."""
        return np.array([one.rgba for one in self.types], np.uint8)

    @property
    def warnings(self) -> List[str]:
        """What reading, or the last save, left out."""
        text = ctypes.create_string_buffer(4096)
        found = []
        for i in range(self._count(_c.lib.quoin_scene_warning_count)):
            _c.check(_c.lib.quoin_scene_warning(self._owner.handle, i, text, len(text)))
            found.append(text.value.decode("utf-8", "replace"))
        return found

    def add_type(self, type: Union[VoxelType, Colour]) -> int:
        """Adds a type, or a colour of three or four bytes, and returns its number."""
        if not isinstance(type, VoxelType):
            rgba = tuple(int(v) for v in type)
            if len(rgba) not in (3, 4):
                raise ValueError("a colour is three or four numbers")
            type = VoxelType((rgba + (255,))[:4])  # type: ignore[arg-type]
        if len(type.rgba) != 4 or not all(0 <= v <= 255 for v in type.rgba):
            raise ValueError("a colour's numbers are 0 to 255")
        one = _c.sized(_c.Type)
        one.rgba[:] = type.rgba
        one.name = type.name.encode()[:127]
        one.emission, one.metalness, one.roughness = type.emission, type.metalness, type.roughness
        out = ctypes.c_uint16()
        _c.check(_c.lib.quoin_type_add(self._owner.handle, ctypes.byref(one), ctypes.byref(out)))
        return out.value

    def add(self, array: np.ndarray, origin: Sequence[float] = (0, 0, 0), name: str = "") -> Grid:
        """Adds a grid of the types in an array [x, y, z] of uint8 or uint16, 0 for air, which is read as it lies."""
        given = _c.array_of(array, (1, 1, 1), origin)
        out = ctypes.c_size_t()
        _c.check(_c.lib.quoin_grid_add(self._owner.handle, ctypes.byref(given), name.encode(), ctypes.byref(out)))
        return Grid(self, out.value)

    def save(self, path: Path) -> None:
        """Writes a file by its ending: .vox, .json, .quoin; or meshes: .glb, .gltf, .obj, .ply."""
        _c.check(_c.lib.quoin_scene_save(self._owner.handle, os.fsencode(path)))

    def render(self, width: int = 1280, height: int = 720, *, samples: int = 0, paths: bool = False,
               camera: Optional[Sequence[float]] = None, look_at: Sequence[float] = (0, 0, 0), fov: float = 45.0,
               out: Optional[np.ndarray] = None, threads: int = 0) -> np.ndarray:
        """A picture, uint8 (height, width, 3), sRGB. Without a camera the whole scene is shown. `paths`: light with its
        bounces and soft shadows, which takes longer. `out` is filled in place where it is given."""
        if width <= 0 or height <= 0:
            raise ValueError("a picture has pixels")
        options = _c.sized(_c.RenderOptions)
        options.width, options.height, options.samples = width, height, samples
        options.paths, options.threads = int(paths), threads
        if camera is not None:
            options.has_camera, options.fov_degrees = 1, fov
            options.camera[:], options.look_at[:] = camera, look_at
        if out is None:
            out = np.empty((height, width, 3), np.uint8)
        elif out.shape != (height, width, 3) or out.dtype != np.uint8 or not out.flags.c_contiguous \
                or not out.flags.writeable:
            raise ValueError("out is a writable uint8 array (height, width, 3) without gaps")
        _c.check(_c.lib.quoin_scene_render(self._owner.handle, ctypes.byref(options), out.ctypes.data, out.size))
        return out

    def rays(self, origins: Any, directions: Any, max_t: float = np.inf) -> Hits:
        """What each ray (n, 3) meets first.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> scene.rays([[0.5, 9, 0.5]], [[0, -1, 0]]).t
        array([7.])
        """
        start = np.ascontiguousarray(origins, np.float64)
        way = np.ascontiguousarray(directions, np.float64)
        if start.ndim != 2 or start.shape[1] != 3 or way.shape != start.shape:
            raise ValueError("origins and directions have the shape (n, 3)")
        n = len(start)
        hits = Hits(np.empty(n), np.empty((n, 3), np.int32), np.empty(n, np.uint16), np.empty((n, 3)))
        given = _c.sized(_c.HitArrays)
        given.t, given.voxel, given.type, given.normal = (one.ctypes.data for one in hits)
        _c.check(_c.lib.quoin_scene_rays(self._owner.handle, n, start.ctypes.data, way.ctypes.data, max_t,
                                         ctypes.byref(given)))
        return hits

    def __repr__(self) -> str:
        return f"<quoin.Scene: {len(self.grids)} grids, {len(self.types) - 1} types>"


def load(path: Path) -> Scene:
    """Reads a file of any format that Quoin reads: .vox, .json, .quoin, .nii, .nrrd.

    >>> load("nothing.vox")
    Traceback (most recent call last):
    ...
    quoin._c.QuoinError: nothing.vox: No such file or directory
    """
    out = ctypes.c_uint64()
    _c.check(_c.lib.quoin_scene_load(os.fsencode(path), ctypes.byref(out)))
    return Scene(_Owner(out.value))


def from_numpy(array: np.ndarray, palette: Iterable[Union[VoxelType, Colour]], name: str = "") -> Scene:
    """A scene of one grid. `array` [x, y, z] has 0 for air and i for the i-th entry of the palette, from 1 on."""
    scene = Scene()
    for one in palette:
        scene.add_type(one)
    scene.add(array, name=name)
    return scene


def surface_nets(array: np.ndarray, iso: float, spacing: Sequence[float] = (1, 1, 1),
                 origin: Sequence[float] = (0, 0, 0), solid: str = "above", threads: int = 0) -> Mesh:
    """The surface where an array [x, y, z] of any number type and strides has the value `iso`; nothing is copied.

    `solid`: "above" where greater values are solid (scans), "below" for signed distances.

    >>> x, y, z = np.mgrid[-8:9, -8:9, -8:9]
    >>> ball = surface_nets(np.sqrt(x * x + y * y + z * z), 6.0, origin=(-8, -8, -8), solid="below")
    >>> bool(np.allclose(np.linalg.norm(ball.positions, axis=1), 6.0, atol=0.2))
    True
    """
    if solid not in ("above", "below"):
        raise ValueError('solid is "above" or "below"')
    given = _c.array_of(array, spacing, origin)
    out = ctypes.c_uint64()
    _c.check(_c.lib.quoin_surface_nets(ctypes.byref(given), iso, int(solid == "below"), threads, ctypes.byref(out)))
    return Mesh(_Owner(out.value))


def mesh_labels(array: np.ndarray, background: int = 0, spacing: Sequence[float] = (1, 1, 1),
                origin: Sequence[float] = (0, 0, 0), relaxation_steps: int = 4, threads: int = 0) -> Mesh:
    """The surfaces between the whole numbers of an array, as one mesh: neighbours share their faces; see
    `Mesh.interfaces` and `Mesh.of_label`. Nothing is copied."""
    given = _c.array_of(array, spacing, origin)
    out = ctypes.c_uint64()
    _c.check(_c.lib.quoin_mesh_labels(ctypes.byref(given), background, relaxation_steps, threads, ctypes.byref(out)))
    return Mesh(_Owner(out.value))
