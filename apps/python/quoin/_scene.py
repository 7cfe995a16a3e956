"""Scenes: grids, types, instances, cameras and lights."""

from __future__ import annotations

import ctypes
import os
from typing import Any, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _c
from ._c import NdArray
from ._mesh import Mesh
from ._textures import (DIRECTIONS, Element, Face, Orientations, Shapes, Textures, faces_struct, orientations_struct,
                        shapes_struct)

Path = Union[str, "os.PathLike[str]"]
Packs = Iterable[Union[Path, bytes, bytearray, memoryview]]
Colour = Sequence[int]
_FILLS = {"all": 0, "solid": 1, "surface": 2}


class VoxelType(NamedTuple):
    """The material of voxels. A type is transparent if its alpha is below 255 or `transparent` is true."""

    rgba: Tuple[int, ...]  #: sRGB, three or four integers, 0 to 255; default alpha 255
    name: str = ""
    emission: float = 0.0  #: 0: none
    metalness: float = 0.0  #: 0 to 1
    roughness: float = 1.0  #: 0 (a mirror) to 1
    transparent: bool = False  #: makes the type transparent even with an alpha of 255
    ior: float = 1.5  #: index of refraction of transparent types
    scattering: float = 0.0  #: clouds: mean number of scatterings per voxel length; 0: glass
    anisotropy: float = 0.0  #: clouds: mean cosine of the scattering angle, -1 to 1
    light_cost: int = 0  #: levels of propagated light that a step into it costs, 0 to 15; 1: water, leaves
    blocks_light: Optional[bool] = None  #: propagated light does not leave it; None: true unless transparent
    occludes: Optional[bool] = None  #: darkens corners of faces in meshes; None: true unless transparent
    state_bits: int = 0  #: number of bits of its voxels' states, 0 to 32
    collides: bool = True  #: stops moving bodies


class Instance(NamedTuple):
    """A placement of a grid in the world. Several instances can share a grid."""

    grid: int  #: an index into `Scene.grids`; equal to their number if the instance has no grid
    matrix: NdArray  #: float64, (4, 4): transforms points of the grid, in voxels, to the world
    name: str = ""
    visible: bool = True  #: the instance's own flag
    shown: bool = True  #: false if the instance, one of its groups or a layer is hidden
    group: Optional[int] = None  #: an index into `Scene.groups`; None: no group
    layer: str = ""  #: the layer's name; empty: no layer
    saved: bool = True  #: the instance's own flag; .quoin files leave it out if false


class Group(NamedTuple):
    """A group of instances and other groups."""

    name: str
    parent: Optional[int]  #: an index into `Scene.groups`; None: no parent
    shown: bool
    layer: str  #: the layer's name; empty: no layer
    saved: bool = True  #: the group's own flag; .quoin files leave out the group and everything below it if false


class Layer(NamedTuple):
    """Instances and groups that are shown or hidden together, independent of the hierarchy."""

    name: str
    visible: bool = True


class Camera(NamedTuple):
    """A camera of a scene. `right`, `up` and `forward` are perpendicular unit vectors; right is forward x up."""

    position: Tuple[float, ...]  #: x, y, z, in world units
    right: Tuple[float, ...]
    up: Tuple[float, ...]
    forward: Tuple[float, ...]
    fov: float  #: vertical field of view of a perspective camera, in degrees
    view_height: Optional[float] = None  #: image height of an orthographic camera, in world units; None: perspective
    focus_distance: float = 0.0  #: in world units; 0: not stored
    number: int = 0  #: number in the file
    first: bool = False  #: the initial camera


class Lamp(NamedTuple):
    """A light without geometry: a spot light if it has a direction, else a point light."""

    name: str
    position: Tuple[float, ...]  #: x, y, z, in world units
    direction: Optional[Tuple[float, ...]]  #: axis of a spot light; None: a point light
    colour: Tuple[float, ...]  #: linear RGB
    intensity: float  #: light received by a white surface facing the lamp at a distance of 1 world unit
    range: float = float("inf")  #: in world units
    inner_angle: float = 0.0  #: of a spot light, in degrees from its axis
    outer_angle: float = 45.0  #: of a spot light, in degrees from its axis


class Sun(NamedTuple):
    """The sun of a scene, infinitely far away."""

    direction: Tuple[float, ...]  #: from the scene towards the sun; any non-zero length
    brightness: float = 1.0  #: brightness of a white surface facing the sun; 0: no sun
    colour: Tuple[float, ...] = (1.0, 1.0, 1.0)  #: linear RGB
    angle: float = 0.53  #: angular diameter, in degrees


class Ground(NamedTuple):
    """A horizontal ground plane, for path tracing."""

    height: float  #: world y
    colour: Tuple[float, ...] = (0.5, 0.5, 0.5)  #: linear RGB, 0 to 1


class Fog(NamedTuple):
    """Fog below a height, for path tracing."""

    density: float  #: scattering events per world unit
    top: float  #: world y
    colour: Tuple[float, ...] = (1.0, 1.0, 1.0)  #: linear RGB, 0 to 1
    anisotropy: float = 0.0  #: mean cosine of the scattering angle, -0.99 to 0.99


class Environment(NamedTuple):
    """The light and air around a scene, except the sun. All colours are linear RGB."""

    sky: str = "gradient"  #: "gradient" (follows the sun), "fixed" (always day), "physical", "uniform" or "image"
    sky_brightness: float = 1.0
    sky_colour: Tuple[float, ...] = (1.0, 1.0, 1.0)  #: of a uniform sky
    background: Optional[Tuple[float, ...]] = None  #: path tracing shows it to the camera in place of the sky
    lamp_brightness: float = 1.0  #: factor on the light of lamps and emissive voxels
    exposure: Optional[float] = None  #: None: 1, or for path tracing a value that suits the sky
    tone: Optional[str] = None  #: "clamp", "neutral", "agx" or "aces", for path tracing; None: by the sky
    ground: Optional[Ground] = None
    fog: Optional[Fog] = None


_FRONTS = ("towards_player", "away_from_player", "away_from_wall")
_SKIES = ("gradient", "fixed", "physical", "uniform", "image")
_TONES = (None, "clamp", "neutral", "agx", "aces")


class Format(NamedTuple):
    """A file format."""

    name: str
    extensions: Tuple[str, ...]  #: such as (".kv6", ".kvx")
    description: str
    readable: bool
    writable: bool
    is_mesh: bool  #: contains triangles


class Body(NamedTuple):
    """A rigid body: a grid, or one of its pieces. Lengths are in voxels, in the grid's space.

    Densities are masses per voxel. For voxels that are s world units wide, and masses per cubic world unit: multiply
    `mass` by s**3, `centre` by s and `inertia` by s**5.
    """

    mass: float
    centre: Tuple[float, ...]  #: centre of mass
    inertia: NdArray  #: float64, (3, 3): tensor about the centre of mass, along the grid's axes
    voxel_count: int  #: 0 for a density field
    origin: Tuple[int, ...]  #: minimum corner of its tight box
    shape: Tuple[int, ...]
    first: Tuple[int, ...]  #: pieces: a voxel of the piece, the first by z, then y, then x


class Hits(NamedTuple):
    """Ray hits, one entry per ray."""

    t: NdArray  #: float64, (n,): distance in multiples of the direction's length; infinity: no hit
    voxel: NdArray  #: int32, (n, 3): the voxel, in its grid
    type: NdArray  #: uint16, (n,): the voxel's type; 0: no hit
    normal: NdArray  #: float64, (n, 3): in world space; 0: no hit


def _struct_of(type: Union[VoxelType, Colour]) -> Any:
    if not isinstance(type, VoxelType):
        type = VoxelType(tuple(type))
    rgba = tuple(_c.whole(v, "a colour", 0, 255) for v in type.rgba)
    if len(rgba) not in (3, 4):
        raise ValueError("a colour must be three or four numbers")
    one = _c.sized(_c.Type)
    one.rgba[:] = (rgba + (255,))[:4]
    one.name = _c.bytes_of(type.name)
    one.emission, one.metalness, one.roughness = type.emission, type.metalness, type.roughness
    one.transparent, one.ior = int(type.transparent), type.ior
    one.scattering, one.anisotropy = type.scattering, type.anisotropy
    one.light_cost = _c.whole(type.light_cost, "light_cost", 0, 15)
    one.blocks_light, one.occludes = _sign_of(type.blocks_light), _sign_of(type.occludes)
    one.state_bits, one.passable = _c.whole(type.state_bits, "state_bits", 0, 32), int(not type.collides)
    return one


def _sign_of(flag: Optional[bool]) -> int:
    return 0 if flag is None else 1 if flag else -1


def _flag_of(sign: int) -> Optional[bool]:
    return None if sign == 0 else sign > 0


def _numbers_of(numbers: Optional[Sequence[float]]) -> Tuple[Any, int]:
    return (None, 0) if numbers is None else ((ctypes.c_double * len(numbers))(*numbers), len(numbers))


def _body_of(body: Any) -> Body:
    return Body(body.mass, tuple(body.centre), np.array(body.inertia).reshape(3, 3), body.voxels, tuple(body.min),
                tuple(body.extent), tuple(body.first))


def _rows_of(matrix: Any) -> List[float]:
    found = np.asarray(matrix, np.float64)
    if found.shape not in ((4, 4), (3, 4)):
        raise ValueError("a matrix must have the shape (4, 4) or (3, 4)")
    return [float(v) for v in found[:3].ravel()]


def _instance_of(grid: int, matrix: Any, name: str, visible: bool, saved: bool) -> Any:
    given = _c.sized(_c.Instance)
    given.grid, given.name, given.visible, given.unsaved = grid, _c.bytes_of(name), int(visible), int(not saved)
    given.world_from_grid[:] = _rows_of(matrix)
    return given


class Grid:
    """A grid of a scene: voxels, or the density field of a volume."""

    def __init__(self, scene: "Scene", number: int) -> None:
        self._scene = scene
        self._number = number

    @property
    def number(self) -> int:
        """The grid's index in `Scene.grids`."""
        return self._number

    def _info(self) -> Any:
        info = _c.sized(_c.GridInfo)
        _c.check(_c.lib.quoin_grid_get_info(self._scene._owner.handle, self._number, ctypes.byref(info)))
        return info

    @property
    def name(self) -> str:
        """The grid's name."""
        return _c.text_of(self._info().name)

    @property
    def voxel_count(self) -> int:
        """The number of voxels that are not air."""
        return int(self._info().voxels)

    @property
    def origin(self) -> Tuple[int, int, int]:
        """The minimum corner of the tight box around the grid's voxels, or around its field's solid."""
        x, y, z = self._info().min
        return x, y, z

    @property
    def shape(self) -> Tuple[int, int, int]:
        """The size of the tight box along x, y and z, in voxels."""
        x, y, z = self._info().extent
        return x, y, z

    @property
    def has_field(self) -> bool:
        """True if the grid has a density field: the smooth surface of a volume."""
        return bool(self._info().has_field)

    @property
    def saved(self) -> bool:
        """False if .quoin files leave out the grid and its instances."""
        return not self._info().unsaved

    @saved.setter
    def saved(self, saved: bool) -> None:
        self._store(saved, self.whole)

    @property
    def whole(self) -> bool:
        """True if a program that streams the saved .quoin file loads the whole grid when it opens the file: for small
        grids that are placed many times.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)], "box")
        >>> scene.grids[0].whole = True
        >>> scene.grids[0].whole, scene.grids[0].saved
        (True, True)
        """
        return bool(self._info().whole)

    @whole.setter
    def whole(self, whole: bool) -> None:
        self._store(self.saved, whole)

    def _store(self, saved: bool, whole: bool) -> None:
        _c.check(_c.lib.quoin_grid_set_storage(self._scene._owner.handle, self._number, int(not saved), int(whole)))

    def to_numpy(self, origin: Optional[Sequence[int]] = None, shape: Optional[Sequence[int]] = None) -> NdArray:
        """Copies the voxel types of a box to a new array: uint16, (nx, ny, nz), 0 is air.

        `origin`, `shape`: three integers each, in the grid's voxels; default: the grid's `origin` and `shape`. Raises
        TypeError if they are not integers, and ValueError if they are not three or a size is negative.
        """
        return self._read(_c.lib.quoin_grid_read, np.uint16, origin, shape)

    def states(self, origin: Optional[Sequence[int]] = None, shape: Optional[Sequence[int]] = None) -> NdArray:
        """Copies the states of a box's voxels to a new array: uint32, (nx, ny, nz). `origin`, `shape`: as in
        `to_numpy`. A state has 32 bits and is 0 by default. It selects among the orientations and shapes of the
        voxel's type."""
        return self._read(_c.lib.quoin_grid_read_states, np.uint32, origin, shape)

    def _read(self, function: Any, dtype: Any, origin: Optional[Sequence[int]],
              shape: Optional[Sequence[int]]) -> NdArray:
        info = self._info()
        at = [_c.whole(v, "origin") for v in (info.min if origin is None else origin)]
        extent = [_c.whole(v, "shape") for v in (info.extent if shape is None else shape)]
        if len(at) != 3 or len(extent) != 3 or min(extent) < 0:
            raise ValueError("origin and shape must be three integers")
        out = np.zeros(extent, dtype)
        three = ctypes.c_int32 * 3
        _c.check(function(self._scene._owner.handle, self._number, three(*at), three(*extent), out.ctypes.data,
                          out.size))
        return out

    def write(self, array: NdArray, origin: Optional[Sequence[float]] = None) -> None:
        """Replaces the voxels of a box. Saving a loaded file keeps its other contents.

        `array`: uint8, uint16 or bool, (nx, ny, nz): types of the scene, 0 is air. `origin`: minimum corner of the
        box, rounded down; default: the grid's `origin`. Raises TypeError for any other dtype, ValueError for a wrong
        shape, and QuoinError if the scene lacks a type; then nothing changes.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0), (0, 0, 255)])
        >>> types = scene.grids[0].to_numpy()
        >>> types[0] = 2
        >>> scene.grids[0].write(types)
        >>> scene.grids[0].to_numpy()[:, 0, 0].tolist()
        [2, 1]
        """
        given = _c.types_of(array, self.origin if origin is None else origin)
        _c.check(_c.lib.quoin_grid_write(self._scene._owner.handle, self._number, ctypes.byref(given)))

    def write_states(self, array: NdArray, origin: Optional[Sequence[float]] = None) -> None:
        """Replaces the states of a box's voxels. Air ignores them. `write` makes the state of a voxel 0 if it changes
        the voxel's type, and else keeps it.

        `array`: uint8, uint16 or uint32, (nx, ny, nz). `origin`: as in `write`. Raises TypeError for any other dtype,
        ValueError for a wrong shape, and QuoinError if a state has more bits than its type; then nothing changes.

        >>> scene = from_numpy(np.ones((3, 1, 1), np.uint8), [VoxelType((90, 60, 30), "log", state_bits=2)])
        >>> scene.set_orientations(1, "along_axes")
        >>> scene.grids[0].write_states(np.array([[[0]], [[1]], [[2]]], np.uint8))
        >>> scene.grids[0].states()[:, 0, 0].tolist()
        [0, 1, 2]
        """
        given = _c.states_of(array, self.origin if origin is None else origin)
        _c.check(_c.lib.quoin_grid_write_states(self._scene._owner.handle, self._number, ctypes.byref(given)))

    def body(self, densities: Optional[Sequence[float]] = None) -> Body:
        """Returns the mass, the centre of mass and the inertia of the grid: of its density field if it has one.

        `densities`: mass of one voxel by type, 0 or more and finite; entry 0 is for a field's solid without a material.
        Types beyond the list weigh nothing. Default: 1 for all. Raises QuoinError for invalid densities.

        >>> scene = from_numpy(np.ones((4, 2, 2), np.uint8), [(255, 0, 0)])
        >>> body = scene.grids[0].body([0, 0.5])
        >>> body.mass, body.centre
        (8.0, (2.0, 1.0, 1.0))
        """
        out = _c.sized(_c.Body)
        given, count = _numbers_of(densities)
        _c.check(_c.lib.quoin_grid_body(self._scene._owner.handle, self._number, given, count, ctypes.byref(out)))
        return _body_of(out)

    def pieces(self, densities: Optional[Sequence[float]] = None) -> List[Body]:
        """Finds the pieces of the grid's voxels, connected by faces, in the order of their first voxels.

        `densities`: as in `body`. Density fields have no pieces.

        >>> array = np.zeros((5, 1, 1), np.uint8)
        >>> array[[0, 3, 4]] = 1
        >>> [piece.mass for piece in from_numpy(array, [(255, 0, 0)]).grids[0].pieces()]
        [1.0, 2.0]
        """
        given, count = _numbers_of(densities)
        found = ctypes.c_size_t()
        room: Any = ()
        while True:
            _c.check(_c.lib.quoin_grid_pieces(self._scene._owner.handle, self._number, given, count, room or None,
                                              len(room), ctypes.byref(found)))
            if found.value <= len(room):
                return [_body_of(one) for one in room[:found.value]]
            room = (_c.Body * found.value)(_c.sized(_c.Body))  # again if another thread adds pieces

    def mesh(self, smooth: bool = False, occlusion: bool = True, threads: int = 0, watertight: bool = False,
             textures: Optional[Textures] = None) -> Mesh:
        """Meshes the grid as blocks with merged faces, or as a smooth surface. Positions are in the grid's voxels.

        Equal neighbouring block faces are merged to quads, which can cover many voxel faces. A quad has two triangles
        and four vertices, which are consecutive in the mesh's arrays: `types[::4]` is the type of each quad.

        `smooth`: makes a smooth surface. `occlusion`: computes `Mesh.occlusion` of blocks. `watertight`: adds a vertex
        where an edge of a quad meets a corner of another quad. This avoids visible gaps, but quads may then have more
        than four vertices. Smooth surfaces are always watertight. `textures`: numbers `Mesh.textures`; default: as
        `Scene.textures` does now.
        """
        options = _c.sized(_c.MeshOptions)
        options.smooth, options.no_occlusion = int(smooth), int(not occlusion)
        options.watertight = int(watertight)
        if textures is not None:
            options.textures = textures._owner.handle
        options.threads = _c.whole(threads, "threads")
        out = ctypes.c_uint64()
        _c.check(_c.lib.quoin_grid_mesh(self._scene._owner.handle, self._number, ctypes.byref(options),
                                        ctypes.byref(out)))
        return Mesh(_c.Owner(out.value))

    def __repr__(self) -> str:
        return f"<quoin.Grid {self.name!r}: {self.voxel_count} voxels, {'x'.join(map(str, self.shape))}>"


class Scene:
    """Grids, voxel types, instances, cameras and lights. `Scene()` is empty; `load` and `from_numpy` fill a scene."""

    def __init__(self, _owner: Optional[_c.Owner] = None) -> None:
        if _owner is None:
            out = ctypes.c_uint64()
            _c.check(_c.lib.quoin_scene_create(ctypes.byref(out)))
            _owner = _c.Owner(out.value)
        self._owner = _owner

    def _count(self, function: Any) -> int:
        out = ctypes.c_size_t()
        _c.check(function(self._owner.handle, ctypes.byref(out)))
        return out.value

    @property
    def grids(self) -> List[Grid]:
        """The grids, in order of their numbers."""
        return [Grid(self, i) for i in range(self._count(_c.lib.quoin_grid_count))]

    def _all(self, count: Any, get: Any, structure: Any, first: int = 0) -> Iterator[Any]:
        for i in range(first, first + self._count(count)):
            one = _c.sized(structure)
            _c.check(get(self._owner.handle, i, ctypes.byref(one)))
            yield one

    def _info(self) -> Any:
        info = _c.sized(_c.SceneInfo)
        _c.check(_c.lib.quoin_scene_get_info(self._owner.handle, ctypes.byref(info)))
        return info

    @property
    def format(self) -> str:
        """The format of the loaded file, such as "vox"; empty if the scene was not loaded."""
        return _c.text_of(self._info().format)

    @property
    def bounds(self) -> Tuple[Tuple[float, ...], Tuple[float, ...]]:
        """The minimum and maximum corner of everything visible, in world space; all 0 if the scene is empty."""
        info = self._info()
        return tuple(info.min), tuple(info.max)

    @property
    def sun(self) -> Optional[Tuple[float, ...]]:
        """The direction from the scene towards the sun; None if the scene has no sun."""
        info = self._info()
        return tuple(info.sun) if info.has_sun else None

    @property
    def last_frame(self) -> int:
        """The number of the animation's last frame. `load` shows the frame given as `frame`."""
        return int(self._info().last_frame)

    @property
    def instances(self) -> List[Instance]:
        """The placements of grids, in order of their numbers.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)], "box")
        >>> scene.place(scene.grids[0], [[0, 0, 1, 5], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
        1
        >>> [one.name for one in scene.instances], scene.instances[1].matrix[0].tolist()
        (['box', 'box'], [0.0, 0.0, 1.0, 5.0])
        """
        found = []
        for one in self._all(_c.lib.quoin_instance_count, _c.lib.quoin_instance_get, _c.Instance):
            matrix = np.eye(4)
            matrix[:3] = np.array(one.world_from_grid).reshape(3, 4)
            found.append(Instance(one.grid, matrix, _c.text_of(one.name), bool(one.visible), bool(one.shown),
                                  one.group - 1 if one.group else None, _c.text_of(one.layer), not one.unsaved))
        return found

    @property
    def groups(self) -> List[Group]:
        """The groups of instances, parents first."""
        return [Group(_c.text_of(one.name), one.parent - 1 if one.parent else None, bool(one.shown),
                      _c.text_of(one.layer), not one.unsaved)
                for one in self._all(_c.lib.quoin_group_count, _c.lib.quoin_group_get, _c.Group, 1)]

    @property
    def layers(self) -> List[Layer]:
        """The layers of instances and groups, identified by name."""
        return [Layer(_c.text_of(one.name), bool(one.visible))
                for one in self._all(_c.lib.quoin_layer_count, _c.lib.quoin_layer_get, _c.Layer)]

    @property
    def cameras(self) -> List[Camera]:
        """The cameras of the loaded file and of `add_camera`."""
        return [Camera(tuple(one.position), tuple(one.right), tuple(one.up), tuple(one.forward),
                       one.vertical_fov_degrees, one.view_height if one.is_orthographic else None,
                       one.focus_distance, one.number, bool(one.is_first))
                for one in self._all(_c.lib.quoin_camera_count, _c.lib.quoin_camera_get, _c.Camera)]

    @property
    def lamps(self) -> List[Lamp]:
        """The lights without geometry. Voxel types with emission also emit light but are not listed here."""
        return [Lamp(_c.text_of(one.name), tuple(one.position), tuple(one.direction) if one.is_spot else None,
                     tuple(one.colour), one.intensity, one.range, one.inner_angle_degrees, one.outer_angle_degrees)
                for one in self._all(_c.lib.quoin_lamp_count, _c.lib.quoin_lamp_get, _c.Lamp)]

    @property
    def sun_light(self) -> Optional[Sun]:
        """The sun and its light; None if the scene has no sun. Properties that the file lacks have defaults."""
        one = _c.sized(_c.Sun)
        _c.check(_c.lib.quoin_sun_get(self._owner.handle, ctypes.byref(one)))
        if not one.brightness > 0.0:
            return None
        return Sun(tuple(one.direction), one.brightness, tuple(one.colour), one.angle_degrees)

    @property
    def environment(self) -> Environment:
        """The light and air around the scene; the defaults of `render` if the scene has none of its own."""
        one = _c.sized(_c.Environment)
        _c.check(_c.lib.quoin_environment_get(self._owner.handle, ctypes.byref(one)))
        ground = Ground(one.ground_height, tuple(one.ground_colour)) if one.has_ground else None
        fog = Fog(one.fog_density, one.fog_top, tuple(one.fog_colour), one.fog_anisotropy) if one.has_fog else None
        return Environment(_SKIES[one.sky], one.sky_brightness, tuple(one.sky_colour),
                           tuple(one.background) if one.has_background else None, one.lamp_brightness,
                           one.exposure if one.has_exposure else None, _TONES[one.tone], ground, fog)

    @property
    def types(self) -> List[VoxelType]:
        """All voxel types. Entry 0 is air."""
        return [VoxelType(tuple(one.rgba), _c.text_of(one.name), one.emission, one.metalness, one.roughness,
                          bool(one.transparent), one.ior, one.scattering, one.anisotropy, one.light_cost,
                          _flag_of(one.blocks_light), _flag_of(one.occludes), one.state_bits, not one.passable)
                for one in self._all(_c.lib.quoin_type_count, _c.lib.quoin_type_get, _c.Type)]

    @property
    def palette(self) -> NdArray:
        """The types' sRGB colours: uint8, (types, 4). `palette[grid.to_numpy()]` is the colour of each voxel."""
        return np.array([one.rgba for one in self.types], np.uint8)

    @property
    def warnings(self) -> List[str]:
        """Warnings, one line each: first those of loading and voxelizing, then those of the last save."""
        text = ctypes.create_string_buffer(4096)
        found = []
        for i in range(self._count(_c.lib.quoin_scene_warning_count)):
            _c.check(_c.lib.quoin_scene_warning(self._owner.handle, i, text, len(text)))
            found.append(_c.text_of(text.value))
        return found

    def add_type(self, type: Union[VoxelType, Colour]) -> int:
        """Adds a type, or a type with an sRGB colour of three or four integers, 0 to 255. Returns the type's number.

        Raises ValueError or TypeError for an invalid colour, and QuoinError for other properties out of range.
        """
        one = _struct_of(type)
        out = ctypes.c_uint16()
        _c.check(_c.lib.quoin_type_add(self._owner.handle, ctypes.byref(one), ctypes.byref(out)))
        return out.value

    def set_type(self, type: int, properties: Union[VoxelType, Colour]) -> None:
        """Replaces the properties of a type. Its faces, orientations and shapes stay. Set `blocks_light` of a type with
        shapes after its shapes. Raises errors like `add_type`.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> scene.set_type(1, scene.types[1]._replace(emission=2.0))
        >>> scene.types[1].emission
        2.0
        """
        one = _struct_of(properties)
        _c.check(_c.lib.quoin_type_set(self._owner.handle, _c.size(type, "type"), ctypes.byref(one)))

    def set_faces(self, type: int, faces: Union[Face, Sequence[Face], None]) -> None:
        """Sets the textures of a type: one face for all sides, three (sides, top, bottom), or six in the order +X, -X,
        +Y, -Y, +Z, -Z. The type's colour becomes their mean. None removes the textures, and the type keeps its colour.

        An image has 16, 32, 64, 128, 256, 512 or 1,024 texels per side. Opaque faces have no transparent texels; cutout
        and translucent faces need a transparent type. Raises TypeError or ValueError for arrays and numbers that do not
        fit, and QuoinError for other errors; then nothing changes.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> grass, earth = np.full((16, 16, 3), 140, np.uint8), np.full((16, 16, 3), 60, np.uint8)
        >>> scene.set_faces(1, [Face(earth, "earth"), Face(grass, "grass", tint=(110, 200, 80)), Face(earth, "earth")])
        >>> faces = scene.textures().faces(1)
        >>> faces[2].name, faces[2].image.shape, faces[2].tint
        ('grass', (16, 16, 4), (110, 200, 80))
        """
        given = None if faces is None else faces_struct(faces)
        _c.check(_c.lib.quoin_type_set_faces(self._owner.handle, _c.size(type, "type"), given))

    def set_shapes(self, type: int, shapes: Union[Shapes, Element, Sequence[Element], None]) -> None:
        """Sets the shapes of a type: one box, several, or `Shapes` with conditions. None makes it a cube. The type's
        transparency is that of the material: stairs of stone are opaque. `Textures.shapes` reads them back.

        Raises TypeError or ValueError for objects and numbers that do not fit, and QuoinError, which names the part and
        the element, for other errors; then nothing changes.

        >>> scene = from_numpy(np.ones((2, 1, 2), np.uint8), [(170, 170, 165)])
        >>> scene.set_shapes(1, [Element(max=(16, 8, 16)), Element((8, 8, 0), (16, 16, 16))])   # a step
        >>> float(scene.grids[0].mesh().positions[:, 1].max())
        1.0
        """
        given = None if shapes is None else shapes_struct(shapes)
        _c.check(_c.lib.quoin_type_set_shapes(self._owner.handle, _c.size(type, "type"),
                                              None if given is None else ctypes.byref(given)))

    def set_orientations(self, type: int, orientations: Union[Orientations, str, None]) -> None:
        """Sets the orientations that the state of a type's voxels selects, or their name (see `Orientations`). None:
        never turned. Raises QuoinError if the type's `state_bits` do not contain their bits.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [VoxelType((90, 90, 90), "furnace", state_bits=2)])
        >>> scene.set_orientations(1, "about_y")
        >>> scene.orientations(1).by_value
        (0, 44, 5, 41)
        """
        given = None if orientations is None else orientations_struct(orientations)
        _c.check(_c.lib.quoin_type_set_orientations(self._owner.handle, _c.size(type, "type"),
                                                    None if given is None else ctypes.byref(given)))

    def orientations(self, type: int) -> Optional[Orientations]:
        """Returns the orientations that the state of a type's voxels selects; None if it never turns them."""
        one = _c.sized(_c.Orientations)
        _c.check(_c.lib.quoin_type_get_orientations(self._owner.handle, _c.size(type, "type"), ctypes.byref(one)))
        if not one.count:
            return None
        return Orientations(tuple(one.by_value[:one.count]), one.first_bit, DIRECTIONS[one.front])

    def placed_state(self, type: int, face: str, look: Sequence[float], point: Sequence[float] = (0.5, 1.0, 0.5),
                     state: int = 0, front: Optional[str] = None) -> int:
        """Returns the state of a voxel that a player places at a face: the orientation that fits best, with the other
        bits of `state`. Torches point away from the face, slabs and stairs go into the half that was hit.

        `face`: direction of the face that was hit. `look`: direction of the player's view. `point`: the point that
        was hit, in voxels from the hit voxel's minimum corner. All are in the grid's space. `front`: the front turns
        "towards_player", "away_from_player" or "away_from_wall" (the direction of the face); None: by the shape, away
        from the player for stairs.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [VoxelType((250, 220, 120), "torch", state_bits=3)])
        >>> scene.set_orientations(1, "to_directions")
        >>> scene.placed_state(1, "-Z", look=(0, 0, 1))
        5
        """
        given = _c.sized(_c.Placing)
        if face not in DIRECTIONS:
            raise ValueError(f"face must be one of {', '.join(DIRECTIONS)}, not {face!r}")
        if front is not None and front not in _FRONTS:
            raise ValueError(f"front must be one of {', '.join(_FRONTS)} or None, not {front!r}")
        given.face, given.front = DIRECTIONS.index(face), 0 if front is None else 1 + _FRONTS.index(front)
        given.point[:], given.look[:] = _c.three(point, "point"), _c.three(look, "look")
        out = ctypes.c_uint32()
        _c.check(_c.lib.quoin_type_placed_state(self._owner.handle, _c.size(type, "type"), ctypes.byref(given),
                                                _c.whole(state, "state", 0, 2**32 - 1), ctypes.byref(out)))
        return out.value

    def turned_state(self, type: int, state: int, orientation: int) -> int:
        """Returns the state of a voxel after it was turned or mirrored by an orientation (see `turn_orientation`), such
        as in a turned copy of a building."""
        out = ctypes.c_uint32()
        _c.check(_c.lib.quoin_type_turned_state(self._owner.handle, _c.size(type, "type"),
                                                _c.whole(state, "state", 0, 2**32 - 1),
                                                _c.whole(orientation, "orientation"), ctypes.byref(out)))
        return out.value

    def textures(self, max_layers: int = 0) -> Textures:
        """Numbers the textures of all types, each once, as layers of arrays for a device. `max_layers`: the device's
        limit per array; 0 means 2,048. Adding types keeps the numbers of the textures before them."""
        out = ctypes.c_uint64()
        _c.check(_c.lib.quoin_scene_textures(self._owner.handle, _c.size(max_layers, "max_layers"), ctypes.byref(out)))
        return Textures(_c.Owner(out.value))

    def add(self, array: NdArray, origin: Sequence[float] = (0, 0, 0), name: str = "") -> Grid:
        """Adds a grid and places it at `origin`, rounded down to whole voxels. Returns the grid.

        `array`: uint8, uint16 or bool, (nx, ny, nz): types of the scene, 0 is air. It may have any strides. Raises
        TypeError for any other dtype, ValueError for a wrong shape, and QuoinError if the scene lacks a type.
        """
        given = _c.types_of(array, origin)
        out = ctypes.c_size_t()
        _c.check(_c.lib.quoin_grid_add(self._owner.handle, ctypes.byref(given), _c.name_of(name), ctypes.byref(out)))
        return Grid(self, out.value)

    def place(self, grid: Grid, matrix: Any, name: Optional[str] = None, visible: bool = True,
              saved: bool = True) -> int:
        """Adds an instance of a grid and returns the instance's number.

        `matrix`: (4, 4) or (3, 4), transforms points of the grid, in voxels, to the world. It may rotate, mirror,
        translate and scale uniformly. `name`: default: the grid's name. `saved`: .quoin files leave out the
        instance if false. Raises ValueError if the grid belongs to
        another scene or the matrix has another shape, and QuoinError for any other transform.
        """
        if grid._scene._owner is not self._owner:
            raise ValueError("the grid belongs to another scene")
        given = _instance_of(grid.number, matrix, grid.name if name is None else name, visible, saved)
        out = ctypes.c_size_t()
        _c.check(_c.lib.quoin_instance_add(self._owner.handle, ctypes.byref(given), ctypes.byref(out)))
        return out.value

    def move(self, instance: int, matrix: Any, visible: Optional[bool] = None, name: Optional[str] = None,
             saved: Optional[bool] = None) -> None:
        """Moves an instance. `instance`: an index into `instances`. `matrix`: as in `place`. `visible`, `name`,
        `saved`: None keeps the present value. Raises QuoinError if there is no such instance."""
        given = _c.sized(_c.Instance)
        instance = _c.size(instance, "instance")
        _c.check(_c.lib.quoin_instance_get(self._owner.handle, instance, ctypes.byref(given)))
        given.world_from_grid[:] = _rows_of(matrix)
        if visible is not None:
            given.visible = int(visible)
        if name is not None:
            given.name = _c.bytes_of(name)
        if saved is not None:
            given.unsaved = int(not saved)
        _c.check(_c.lib.quoin_instance_set(self._owner.handle, instance, ctypes.byref(given)))

    def set_layer(self, name: str, visible: bool = True) -> None:
        """Adds a layer, or shows or hides the existing layer of this name.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)], "box")
        >>> scene.set_layer("attic", visible=False)
        >>> scene.assign(0, scene.add_group("house"), "attic")
        >>> scene.instances[0].group, scene.instances[0].layer, scene.instances[0].shown
        (0, 'attic', False)
        """
        given = _c.sized(_c.Layer)
        given.name, given.visible = _c.bytes_of(name), int(visible)
        _c.check(_c.lib.quoin_layer_set(self._owner.handle, ctypes.byref(given)))

    def add_group(self, name: str, parent: Optional[int] = None, visible: bool = True, layer: str = "",
                  saved: bool = True) -> int:
        """Adds a group and returns its index in `groups`. `parent`: an index into `groups`; None: no parent. `layer`:
        the name of an existing layer; empty: no layer. `saved`: .quoin files leave out the group and everything below
        it if false."""
        given = _c.sized(_c.Group)
        given.name, given.layer, given.shown = _c.bytes_of(name), _c.bytes_of(layer), int(visible)
        given.unsaved = int(not saved)
        given.parent = 0 if parent is None else _c.size(parent, "parent") + 1
        out = ctypes.c_size_t()
        _c.check(_c.lib.quoin_group_add(self._owner.handle, ctypes.byref(given), ctypes.byref(out)))
        return out.value - 1

    def assign(self, instance: int, group: Optional[int] = None, layer: str = "") -> None:
        """Assigns an instance to an existing group and layer; the defaults remove it from both. The instance does not
        move. `instance`, `group`: indices into `instances` and `groups`."""
        given = _c.sized(_c.Instance)
        instance = _c.size(instance, "instance")
        _c.check(_c.lib.quoin_instance_get(self._owner.handle, instance, ctypes.byref(given)))
        given.group = 0 if group is None else _c.size(group, "group") + 1
        _c.check(_c.lib.quoin_instance_set(self._owner.handle, instance, ctypes.byref(given)))
        _c.check(_c.lib.quoin_instance_set_layer(self._owner.handle, instance, _c.name_of(layer)))

    def add_camera(self, camera: Camera) -> None:
        """Adds a camera. `render` does not use it: pass `camera`. Raises QuoinError if its number is in use or its axes
        are invalid.

        .quoin and .vox files store all cameras, .json files only the initial one.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> scene.add_camera(Camera((0, 1, 9), (1, 0, 0), (0, 1, 0), (0, 0, -1), 40.0))
        >>> scene.cameras[0].fov
        40.0
        """
        one = _c.sized(_c.Camera)
        one.number, one.is_first = _c.whole(camera.number, "number"), int(camera.first)
        one.position[:], one.right[:] = camera.position, camera.right
        one.up[:], one.forward[:] = camera.up, camera.forward
        one.vertical_fov_degrees, one.focus_distance = camera.fov, camera.focus_distance
        if camera.view_height is not None:
            one.is_orthographic, one.view_height = 1, camera.view_height
        _c.check(_c.lib.quoin_camera_add(self._owner.handle, ctypes.byref(one)))

    def add_lamp(self, lamp: Lamp) -> None:
        """Adds a lamp. Only .quoin and .json files store lamps. Raises QuoinError for values out of range."""
        one = _c.sized(_c.Lamp)
        one.name, one.position[:], one.colour[:] = _c.bytes_of(lamp.name), lamp.position, lamp.colour
        one.intensity, one.range = lamp.intensity, lamp.range
        if lamp.direction is not None:
            one.is_spot, one.direction[:] = 1, lamp.direction
            one.inner_angle_degrees, one.outer_angle_degrees = lamp.inner_angle, lamp.outer_angle
        _c.check(_c.lib.quoin_lamp_add(self._owner.handle, ctypes.byref(one)))

    def set_environment(self, environment: Optional[Environment]) -> None:
        """Sets the light and air around the scene, which `render` uses. .json and .quoin files store them. None
        removes them and the sun. Raises ValueError for unknown names and QuoinError for values out of range."""
        if environment is None:
            _c.check(_c.lib.quoin_environment_set(self._owner.handle, None))
            return
        one = _c.sized(_c.Environment)
        one.sky, one.tone = _SKIES.index(environment.sky), _TONES.index(environment.tone)
        one.sky_brightness, one.lamp_brightness = environment.sky_brightness, environment.lamp_brightness
        one.sky_colour[:] = environment.sky_colour
        if environment.background is not None:
            one.has_background, one.background[:] = 1, environment.background
        if environment.exposure is not None:
            one.has_exposure, one.exposure = 1, environment.exposure
        if environment.ground is not None:
            one.has_ground, one.ground_height = 1, environment.ground.height
            one.ground_colour[:] = environment.ground.colour
        if environment.fog is not None:
            one.has_fog, one.fog_density, one.fog_top = 1, environment.fog.density, environment.fog.top
            one.fog_colour[:], one.fog_anisotropy = environment.fog.colour, environment.fog.anisotropy
        _c.check(_c.lib.quoin_environment_set(self._owner.handle, ctypes.byref(one)))

    def set_sun(self, sun: Sun) -> None:
        """Sets the sun of the scene, which `render` uses. .vox, .json and .quoin files store it. Raises QuoinError for
        values out of range."""
        one = _c.sized(_c.Sun)
        one.direction[:], one.colour[:] = sun.direction, sun.colour
        one.brightness, one.angle_degrees = sun.brightness, sun.angle
        _c.check(_c.lib.quoin_sun_set(self._owner.handle, ctypes.byref(one)))

    def voxelize(self, positions: Any, triangles: Any, voxel_size: float = 1.0, *, colours: Any = None,
                 materials: Any = None, types: Sequence[Union[VoxelType, Colour]] = (), fill: str = "all",
                 name: str = "", max_types: int = 0, threads: int = 0) -> Grid:
        """Voxelizes triangles into a new grid and returns it. The cube with minimum corner `voxel_size` * (x, y, z)
        becomes the world's voxel (x, y, z).

        `positions`: (m, 3), converted to float32. `triangles`: (n, 3), rows of `positions`. `voxel_size`: edge length
        of a voxel, in the unit of `positions`. `colours`: (m, 4), linear RGB and alpha; default white. `materials`:
        (n,), indices into `types`; default 0. `types`: default one light grey type. `fill`: "all" for voxels that are
        enclosed or touched by triangles, "solid" for voxels whose centre is enclosed, "surface" for touched voxels
        only. `max_types`: maximum number of added types, by merging similar colours; 0: no limit.

        Raises ValueError for wrong shapes or an unknown fill, TypeError if indices are not integers, and QuoinError for
        invalid positions or indices.

        >>> corners = [[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8]]
        >>> Scene().voxelize(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], types=[(200, 0, 0)]).shape
        (8, 8, 8)
        """
        if fill not in _FILLS:
            raise ValueError('fill must be "all", "solid" or "surface"')
        corners = _c.rows_of(positions, 3, np.float32, "positions")
        indices = _c.rows_of(_c.indices_of(triangles, "triangles"), 3, np.uint32, "triangles")
        given = _c.sized(_c.Triangles)
        given.vertex_count, given.triangle_count = len(corners), len(indices)
        given.positions, given.indices = corners.ctypes.data, indices.ctypes.data
        if colours is not None:
            colours = _c.rows_of(colours, 4, np.float32, "colours")
            if len(colours) != len(corners):
                raise ValueError("colours must have one entry per position")
            given.colours = colours.ctypes.data
        if materials is not None:
            materials = _c.indices_of(materials, "materials")
            if materials.shape != (len(indices),):
                raise ValueError("materials must have one entry per triangle")
            given.materials = materials.ctypes.data
        structs = (_c.Type * len(types))(*[_struct_of(one) for one in types])
        given.types, given.type_count = ctypes.addressof(structs) if types else None, len(types)
        options = _c.sized(_c.VoxelizeOptions)
        options.voxel_size, options.fill = voxel_size, _FILLS[fill]
        options.max_types, options.threads = _c.whole(max_types, "max_types"), _c.whole(threads, "threads")
        out = ctypes.c_size_t()
        _c.check(_c.lib.quoin_grid_voxelize(self._owner.handle, ctypes.byref(given), ctypes.byref(options),
                                            _c.name_of(name), ctypes.byref(out)))
        return Grid(self, out.value)

    def save(self, path: Path) -> None:
        """Saves the scene in the format of the path's extension. Replaces an existing file.

        .vox, .json, .quoin and others store voxels; .glb, .gltf, .obj, .ply, .stl and .3mf store blocky meshes.
        `formats` lists all. Afterwards `warnings` names the features that the format does not support. Raises
        QuoinError if the format is unknown or read-only, or if the file cannot be written.
        """
        _c.check(_c.lib.quoin_scene_save(self._owner.handle, _c.path_of(path)))

    def render(self, width: int = 1280, height: int = 720, *, samples: int = 0, paths: bool = False,
               camera: Optional[Sequence[float]] = None, look_at: Optional[Sequence[float]] = None, fov: float = 45.0,
               sun: Optional[Sequence[float]] = None, out: Optional[NdArray] = None, threads: int = 0) -> NdArray:
        """Renders an sRGB image and returns it: uint8, (height, width, 3), rows from the top.

        `samples`: per pixel; 0 means 4, or 64 with path tracing. `paths`: path tracing, which is slower and adds
        indirect light and soft shadows. `camera`: position in the world; default: a camera that shows the whole scene.
        `look_at`: point at the image's centre, default (0, 0, 0); needs `camera`. `fov`: vertical field of view of
        `camera`, in degrees. `sun`: direction from the scene towards the sun, of any non-zero length; default: the
        scene's sun, or (-0.48, 0.72, 0.5). The scene's `environment` is used, its cameras are not. `out`: a
        contiguous, writable array of the image's shape and dtype, which is filled and returned.

        Raises ValueError for a size that is not positive or an unsuitable `out`, and QuoinError for an invalid camera,
        sun or number of samples.
        """
        width, height = (_c.whole(v, "the image size") for v in (width, height))
        if width <= 0 or height <= 0:
            raise ValueError("width and height must be positive")
        options = _c.sized(_c.RenderOptions)
        options.width, options.height, options.samples = width, height, _c.whole(samples, "samples")
        options.paths, options.threads = int(paths), _c.whole(threads, "threads")
        if camera is not None:
            options.has_camera, options.fov_degrees = 1, fov
            options.camera[:] = _c.three(camera, "camera")
            options.look_at[:] = _c.three((0, 0, 0) if look_at is None else look_at, "look_at")
        elif look_at is not None:
            raise ValueError("look_at needs camera")
        if sun is not None:
            options.has_sun, options.sun[:] = 1, _c.three(sun, "sun")
        if out is None:
            out = np.empty((height, width, 3), np.uint8)
        elif not isinstance(out, np.ndarray):
            raise TypeError("out must be a NumPy array")
        elif out.shape != (height, width, 3) or out.dtype != np.uint8 or not out.flags.c_contiguous \
                or not out.flags.writeable:
            raise ValueError("out must be a contiguous, writable uint8 array (height, width, 3)")
        _c.check(_c.lib.quoin_scene_render(self._owner.handle, ctypes.byref(options), out.ctypes.data, out.size))
        return out

    def rays(self, origins: Any, directions: Any, max_t: float = np.inf) -> Hits:
        """Finds the nearest voxel or surface along each ray.

        `origins`, `directions`: (n, 3), in world space; directions of any length. `max_t`: maximum distance, in
        multiples of the direction's length. The first call builds a tree, which the scene keeps and updates after
        changes. Raises ValueError for wrong shapes. Rays with NaN hit nothing.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> scene.rays([[0.5, 9, 0.5]], [[0, -1, 0]]).t
        array([7.])
        """
        start = _c.rows_of(origins, 3, np.float64, "origins and directions")
        way = _c.rows_of(directions, 3, np.float64, "origins and directions")
        if way.shape != start.shape:
            raise ValueError("directions must have one entry per origin")
        n = len(start)
        hits = Hits(np.empty(n), np.empty((n, 3), np.int32), np.empty(n, np.uint16), np.empty((n, 3)))
        given = _c.sized(_c.HitArrays)
        given.t, given.voxel, given.type, given.normal = (one.ctypes.data for one in hits)
        _c.check(_c.lib.quoin_scene_rays(self._owner.handle, n, start.ctypes.data, way.ctypes.data, max_t,
                                         ctypes.byref(given)))
        return hits

    def __repr__(self) -> str:
        return f"<quoin.Scene: {len(self.grids)} grids, {len(self.types) - 1} types>"


class Raw:
    """Describes a file that contains only values, for `load`.

    `shape`: number of values along each of three axes; the first axis varies fastest. `dtype`: a NumPy dtype of any
    byte order: "uint8", ">i2", np.float32. Raises ValueError for other shapes, TypeError for unsupported dtypes.
    """

    def __init__(self, shape: Sequence[int], dtype: Any = "uint8") -> None:
        self.shape = tuple(_c.whole(length, "shape") for length in shape)
        if len(self.shape) != 3 or min(self.shape) < 1:
            raise ValueError(f"raw values must have three non-empty axes, not {self.shape}")
        self.dtype = np.dtype(dtype)
        self._scalar, self._is_big_endian = _c.scalar_of(dtype, "values")


class Heights:
    """Describes a PNG image of heights, for `load`.

    `encoding`: "grey": the height is the grey level times `metres_per_level`; "mapbox": (65,536 R + 256 G + B) / 10 -
    10,000 metres; "terrarium": 256 R + G + B / 256 - 32,768 metres. `metres_per_pixel`: distance between neighbouring
    samples; default 1, with a warning. `metres_per_voxel`: edge length of a voxel; default `metres_per_pixel`.
    `exaggeration`: factor on heights. `ground_depth`: voxels of ground below the lowest height. `smooth`: makes a
    density field with a smooth surface instead of voxels. Raises ValueError for values out of range.
    """

    ENCODINGS = ("grey", "mapbox", "terrarium")

    def __init__(self, encoding: str = "grey", *, metres_per_level: float = 1.0,
                 metres_per_pixel: Optional[float] = None, metres_per_voxel: Optional[float] = None,
                 exaggeration: float = 1.0, ground_depth: int = 8, smooth: bool = False) -> None:
        if encoding not in self.ENCODINGS:
            raise ValueError(f"encoding must be one of {', '.join(self.ENCODINGS)}, not {encoding!r}")
        self.encoding = encoding
        # The library treats 0 as not given.
        for name, given in (("metres_per_level", metres_per_level), ("metres_per_pixel", metres_per_pixel),
                            ("metres_per_voxel", metres_per_voxel), ("exaggeration", exaggeration)):
            if given is not None and not given > 0.0:
                raise ValueError(f"{name} must be positive, not {given}")
        self.metres_per_level, self.exaggeration = metres_per_level, exaggeration
        self.metres_per_pixel, self.metres_per_voxel = metres_per_pixel, metres_per_voxel
        self.ground_depth = _c.whole(ground_depth, "ground_depth")
        if self.ground_depth < 1:
            raise ValueError(f"ground_depth must be at least 1, not {ground_depth}")
        self.smooth = smooth


def _load_options(frame: int, show_hidden: bool, radius: int, iso: Optional[float], size: int, voxel_size: float,
                  threads: int, raw: Optional[Raw], heights: Optional[Heights]) -> Any:
    options = _c.sized(_c.LoadOptions)
    options.frame, options.show_hidden = _c.whole(frame, "frame"), int(show_hidden)
    options.radius, options.threads = _c.whole(radius, "radius"), _c.whole(threads, "threads")
    options.has_iso, options.iso = int(iso is not None), iso or 0.0
    options.mesh_voxels, options.voxel_size = _c.whole(size, "size"), voxel_size
    if raw is not None:
        if not isinstance(raw, Raw):
            raise TypeError("raw must be a quoin.Raw")
        options.raw_shape[:] = raw.shape
        options.raw_scalar, options.raw_big_endian = raw._scalar, int(raw._is_big_endian)
    if heights is not None:
        if not isinstance(heights, Heights):
            raise TypeError("heights must be a quoin.Heights")
        options.heights = 1 + Heights.ENCODINGS.index(heights.encoding)
        options.metres_per_level, options.exaggeration = heights.metres_per_level, heights.exaggeration
        options.metres_per_pixel = heights.metres_per_pixel or 0.0
        options.metres_per_voxel = heights.metres_per_voxel or 0.0
        options.ground_depth, options.smooth_ground = heights.ground_depth, int(heights.smooth)
    return options


def _bytes_of(data: Union[bytes, bytearray, memoryview]) -> NdArray:
    """Returns the bytes of a contiguous buffer, in place. Raises TypeError for other objects."""
    held = memoryview(data).cast("B")
    return np.frombuffer(held, np.uint8) if held.nbytes else np.zeros(0, np.uint8)


def _add_packs(options: Any, packs: Packs, scene_packs: bool) -> List[NdArray]:
    """Sets resource packs. The options hold the paths; the caller must keep the result until the call is over."""
    if isinstance(packs, (str, bytes, bytearray, memoryview, os.PathLike)):
        raise TypeError("packs must be a list of packs")
    paths, zips = [], []
    for one in packs:
        if isinstance(one, (bytes, bytearray, memoryview)):
            zips.append(_bytes_of(one))
        elif zips:
            raise ValueError("packs from bytes are above packs from files: list them last")
        else:
            paths.append(_c.path_of(one))
    options.packs, options.pack_count = (ctypes.c_char_p * len(paths))(*paths), len(paths)
    options.pack_zips = (ctypes.c_void_p * len(zips))(*(one.ctypes.data for one in zips))
    options.pack_zip_bytes = (ctypes.c_size_t * len(zips))(*(one.size for one in zips))
    options.pack_zip_count, options.ignore_scene_packs = len(zips), int(not scene_packs)
    return zips


def load(path: Path, *, frame: int = 0, show_hidden: bool = False, radius: int = 0, iso: Optional[float] = None,
         size: int = 0, voxel_size: float = 0.0, threads: int = 0, raw: Optional[Raw] = None,
         heights: Optional[Heights] = None, allow_outside_files: bool = False,
         dimension: Optional[str] = None, packs: Packs = (), scene_packs: bool = True) -> Scene:
    """Loads a file of any readable format (see `formats`), or the folder of a world.

    Any file: `frame`: animation frame. `show_hidden`: shows hidden instances, groups and layers. `raw`: reads the file
    as raw values. `heights`: reads the file as a height map. `allow_outside_files`: also opens files that the file
    names outside its folder (buffers, images, models); only for input from a trusted source.

    Worlds: `radius`: chunks of 64 voxels to load on each side of the spawn point; 0 means 4. `dimension` (Minecraft):
    "overworld", "nether", "end" or "NAMESPACE:NAME"; default: the overworld, or the first dimension if there is none.

    Blocks of Minecraft: `packs`: resource packs for their shapes and textures, the lowest first: paths of folders, zip
    files or client .jar files, and the bytes of zip files, which come last. "builtin" is Quoin's own pack, which gives
    a look to blocks that the other packs lack. `scene_packs=False` does not use the packs that a scene file names.

    Volumes: `iso`: values above it are solid; default: a threshold between the two groups of values.

    Triangle files: `size`: voxels along the longest side; 0 means 128. `voxel_size`: edge length of a voxel, in the
    file's unit; replaces `size`.

    Raises QuoinError if the file or a pack cannot be read, ValueError if a path follows the bytes of a pack.

    >>> load("nothing.vox")
    Traceback (most recent call last):
    ...
    quoin.QuoinError: nothing.vox: No such file or directory
    """
    options = _load_options(frame, show_hidden, radius, iso, size, voxel_size, threads, raw, heights)
    options.allow_outside_files = int(allow_outside_files)
    options.dimension = None if dimension is None else _c.name_of(dimension)
    held = _add_packs(options, packs, scene_packs)
    out = ctypes.c_uint64()
    _c.check(_c.lib.quoin_scene_load_with(_c.path_of(path), ctypes.byref(options), ctypes.byref(out)))
    del held
    return Scene(_c.Owner(out.value))


def load_bytes(data: Union[bytes, bytearray, memoryview], *, frame: int = 0, show_hidden: bool = False, radius: int = 0,
               iso: Optional[float] = None, size: int = 0, voxel_size: float = 0.0, threads: int = 0,
               raw: Optional[Raw] = None, heights: Optional[Heights] = None, packs: Packs = ()) -> Scene:
    """Loads the contents of a file from bytes or any contiguous buffer, which is read in place. Options: see `load`.

    Raises QuoinError if the contents cannot be read, and TypeError if `data` is not a buffer.

    >>> values = np.arange(8, dtype=">u2").reshape(2, 2, 2)
    >>> load_bytes(values.tobytes(), raw=Raw((2, 2, 2), ">u2"), iso=3.5).grids[0].has_field
    True
    """
    options = _load_options(frame, show_hidden, radius, iso, size, voxel_size, threads, raw, heights)
    held = _add_packs(options, packs, True)
    array = _bytes_of(data)
    out = ctypes.c_uint64()
    _c.check(
        _c.lib.quoin_scene_load_bytes_with(array.ctypes.data, array.size, ctypes.byref(options), ctypes.byref(out))
    )
    del held
    return Scene(_c.Owner(out.value))


def from_numpy(array: NdArray, palette: Iterable[Union[VoxelType, Colour]], name: str = "") -> Scene:
    """Creates a scene with one grid at the origin.

    `array`: uint8, uint16 or bool, (nx, ny, nz): 0 is air, i is the i-th entry of the palette, counted from 1.
    `palette`: voxel types, or sRGB colours of three or four integers, 0 to 255. Raises TypeError for any other dtype or
    palette, ValueError for a wrong shape, and QuoinError if the palette is too short.
    """
    scene = Scene()
    for one in palette:
        if not isinstance(one, Iterable):
            raise TypeError("the palette must be a list of colours: [(200, 40, 40), ...]")
        scene.add_type(one)
    scene.add(array, name=name)
    return scene


def formats() -> List[Format]:
    """Lists the formats that can be read or written.

    >>> [one.extensions for one in formats() if one.name == "vox"]
    [('.vox',)]
    """
    count = ctypes.c_size_t()
    _c.check(_c.lib.quoin_format_count(ctypes.byref(count)))
    found = []
    for i in range(count.value):
        one = _c.sized(_c.Format)
        _c.check(_c.lib.quoin_format_get(i, ctypes.byref(one)))
        found.append(Format(_c.text_of(one.name), tuple(_c.text_of(one.extensions).split()),
                            _c.text_of(one.description), bool(one.readable), bool(one.writable), bool(one.is_mesh)))
    return found
