"""Binds quoin.h with ctypes. Every call releases Python's global lock while it runs."""

from __future__ import annotations

import ctypes
import enum
import operator
import os
import sys
import threading
from typing import TYPE_CHECKING, Any, Callable, List, Optional, Sequence, Tuple

import numpy as np

if TYPE_CHECKING:
    NdArray = np.ndarray[Any, Any]
else:
    NdArray = np.ndarray


class Status(enum.IntEnum):
    """The codes of errors, as in quoin.h."""

    OK = 0
    INVALID_ARGUMENT = 1
    CANNOT_READ = 2
    CANNOT_WRITE = 3
    BAD_FORMAT = 4
    UNSUPPORTED = 5
    LIMIT_EXCEEDED = 6
    CANCELLED = 7
    DEVICE_LOST = 8
    BAD_HANDLE = 9
    OUT_OF_MEMORY = 10
    INTERNAL = 11


class QuoinError(Exception):
    """An error reported by the library. The message is one line. `status` is the code of the error."""

    status = Status.OK


# Tracebacks show the public names.
Status.__module__ = QuoinError.__module__ = "quoin"


def _find() -> ctypes.CDLL:
    sidecar = os.path.join(os.path.dirname(__file__), "libquoin_c.so.0")
    return ctypes.CDLL(os.environ.get("QUOIN_LIBRARY") or (sidecar if os.path.exists(sidecar) else "libquoin_c.so.0"))


lib = _find()


class Array(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("data", ctypes.c_void_p), ("scalar", ctypes.c_int32),
                ("shape", ctypes.c_int64 * 3), ("strides", ctypes.c_int64 * 3), ("spacing", ctypes.c_double * 3),
                ("origin", ctypes.c_double * 3)]


class GridInfo(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("voxels", ctypes.c_int64),
                ("min", ctypes.c_int32 * 3), ("extent", ctypes.c_int32 * 3), ("has_field", ctypes.c_int32),
                ("pivot", ctypes.c_double * 3), ("unsaved", ctypes.c_int32), ("whole", ctypes.c_int32)]


class Type(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("rgba", ctypes.c_uint8 * 4), ("emission", ctypes.c_float),
                ("metalness", ctypes.c_float), ("roughness", ctypes.c_float), ("name", ctypes.c_char * 128),
                ("transparent", ctypes.c_int32), ("ior", ctypes.c_float), ("scattering", ctypes.c_float),
                ("anisotropy", ctypes.c_float), ("light_cost", ctypes.c_int32), ("blocks_light", ctypes.c_int32),
                ("occludes", ctypes.c_int32), ("reserved", ctypes.c_int32), ("state_bits", ctypes.c_int32),
                ("passable", ctypes.c_int32)]


NO_TEXTURE = 0xFFFFFFFF


class Face(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("rgba", ctypes.c_void_p),
                ("texels", ctypes.c_int32), ("turn", ctypes.c_int32), ("mirrored", ctypes.c_int32),
                ("alpha", ctypes.c_int32), ("has_tint", ctypes.c_int32), ("tint", ctypes.c_uint8 * 4),
                ("texture", ctypes.c_uint32), ("reserved", ctypes.c_int32), ("has_emission_share", ctypes.c_int32),
                ("emission_share", ctypes.c_int32)]


class TextureArray(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("texels", ctypes.c_int32), ("levels", ctypes.c_int32),
                ("layers", ctypes.c_size_t)]


class Orientations(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("kind", ctypes.c_int32), ("first_bit", ctypes.c_int32),
                ("front", ctypes.c_int32), ("count", ctypes.c_int32), ("by_value", ctypes.c_uint8 * 48)]


class ShapeElement(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("min", ctypes.c_float * 3), ("max", ctypes.c_float * 3),
                ("has_turn", ctypes.c_int32), ("turn_axis", ctypes.c_int32), ("turn_degrees", ctypes.c_float),
                ("turn_origin", ctypes.c_float * 3), ("turn_rescales", ctypes.c_int32), ("passable", ctypes.c_int32),
                ("looks", ctypes.c_int32 * 6), ("has_parts", ctypes.c_uint32), ("parts", ctypes.c_float * 4 * 6),
                ("reserved", ctypes.c_int32)]


class ShapeCondition(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("state_mask", ctypes.c_uint32), ("state", ctypes.c_uint32),
                ("connected", ctypes.c_uint32), ("unconnected", ctypes.c_uint32), ("corner", ctypes.c_int32),
                ("reserved", ctypes.c_int32), ("position_count", ctypes.c_uint32), ("position_first", ctypes.c_uint32),
                ("position_end", ctypes.c_uint32), ("reserved_too", ctypes.c_uint32)]


class ShapePart(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("element_count", ctypes.c_size_t), ("condition_count", ctypes.c_size_t),
                ("orientation", ctypes.c_int32), ("reserved", ctypes.c_int32)]


class Shapes(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("parts", ctypes.c_void_p), ("part_count", ctypes.c_size_t),
                ("elements", ctypes.c_void_p), ("element_count", ctypes.c_size_t), ("conditions", ctypes.c_void_p),
                ("condition_count", ctypes.c_size_t), ("looks", ctypes.c_void_p), ("look_count", ctypes.c_size_t),
                ("neighbours", ctypes.c_int32), ("groups", ctypes.c_uint32), ("ignores_full_sides", ctypes.c_int32),
                ("reserved", ctypes.c_int32), ("fluid_groups", ctypes.c_uint32), ("reserved_too", ctypes.c_uint32),
                ("fluid_condition_count", ctypes.c_size_t)]


class Placing(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("face", ctypes.c_int32), ("front", ctypes.c_int32),
                ("point", ctypes.c_float * 3), ("reserved", ctypes.c_int32), ("look", ctypes.c_double * 3)]


class Instance(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("grid", ctypes.c_size_t),
                ("world_from_grid", ctypes.c_double * 12), ("visible", ctypes.c_int32), ("shown", ctypes.c_int32),
                ("group", ctypes.c_size_t), ("layer", ctypes.c_char * 128), ("unsaved", ctypes.c_int32)]


class Group(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("parent", ctypes.c_size_t),
                ("shown", ctypes.c_int32), ("layer", ctypes.c_char * 128), ("reserved", ctypes.c_int32),
                ("unsaved", ctypes.c_int32)]


class Camera(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("number", ctypes.c_int32), ("is_first", ctypes.c_int32),
                ("is_orthographic", ctypes.c_int32), ("position", ctypes.c_double * 3), ("right", ctypes.c_double * 3),
                ("up", ctypes.c_double * 3), ("forward", ctypes.c_double * 3),
                ("vertical_fov_degrees", ctypes.c_double), ("view_height", ctypes.c_double),
                ("focus_distance", ctypes.c_double)]


class Lamp(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("is_spot", ctypes.c_int32),
                ("position", ctypes.c_double * 3), ("direction", ctypes.c_double * 3), ("colour", ctypes.c_float * 3),
                ("intensity", ctypes.c_double), ("range", ctypes.c_double), ("inner_angle_degrees", ctypes.c_double),
                ("outer_angle_degrees", ctypes.c_double)]


class SceneInfo(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("format", ctypes.c_char * 32), ("min", ctypes.c_double * 3),
                ("max", ctypes.c_double * 3), ("has_sun", ctypes.c_int32), ("sun", ctypes.c_double * 3),
                ("last_frame", ctypes.c_int64)]


class Format(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 32), ("extensions", ctypes.c_char * 64),
                ("description", ctypes.c_char * 128), ("readable", ctypes.c_int32), ("writable", ctypes.c_int32),
                ("is_mesh", ctypes.c_int32)]


class LoadOptions(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("threads", ctypes.c_int32), ("show_hidden", ctypes.c_int32),
                ("frame", ctypes.c_int32), ("radius", ctypes.c_int32), ("has_iso", ctypes.c_int32),
                ("iso", ctypes.c_float), ("mesh_voxels", ctypes.c_int32), ("voxel_size", ctypes.c_double),
                ("raw_shape", ctypes.c_int32 * 3), ("raw_scalar", ctypes.c_int32), ("raw_big_endian", ctypes.c_int32),
                ("heights", ctypes.c_int32), ("metres_per_level", ctypes.c_double),
                ("metres_per_pixel", ctypes.c_double), ("metres_per_voxel", ctypes.c_double),
                ("exaggeration", ctypes.c_double), ("ground_depth", ctypes.c_int32), ("smooth_ground", ctypes.c_int32),
                ("allow_outside_files", ctypes.c_int32), ("dimension", ctypes.c_char_p),
                ("packs", ctypes.POINTER(ctypes.c_char_p)), ("pack_count", ctypes.c_size_t),
                ("pack_zips", ctypes.POINTER(ctypes.c_void_p)), ("pack_zip_bytes", ctypes.POINTER(ctypes.c_size_t)),
                ("pack_zip_count", ctypes.c_size_t), ("ignore_scene_packs", ctypes.c_int32)]


class Triangles(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("vertex_count", ctypes.c_size_t), ("triangle_count", ctypes.c_size_t),
                ("positions", ctypes.c_void_p), ("indices", ctypes.c_void_p), ("colours", ctypes.c_void_p),
                ("materials", ctypes.c_void_p), ("types", ctypes.c_void_p), ("type_count", ctypes.c_size_t)]


class VoxelizeOptions(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("voxel_size", ctypes.c_double), ("fill", ctypes.c_int32),
                ("max_types", ctypes.c_int32), ("threads", ctypes.c_int32)]


class MeshData(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("vertex_count", ctypes.c_size_t), ("index_count", ctypes.c_size_t),
                ("interface_count", ctypes.c_size_t), ("positions", ctypes.c_void_p), ("normals", ctypes.c_void_p),
                ("colours", ctypes.c_void_p), ("occlusion", ctypes.c_void_p), ("indices", ctypes.c_void_p),
                ("interfaces", ctypes.c_void_p), ("types", ctypes.c_void_p), ("textures", ctypes.c_void_p),
                ("texture_uvs", ctypes.c_void_p), ("tints", ctypes.c_void_p),
                ("emission_shares", ctypes.c_void_p)]


class MeshOptions(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("smooth", ctypes.c_int32), ("no_occlusion", ctypes.c_int32),
                ("threads", ctypes.c_int32), ("reserved", ctypes.c_int32), ("watertight", ctypes.c_int32),
                ("textures", ctypes.c_uint64)]


class RenderOptions(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("width", ctypes.c_int32), ("height", ctypes.c_int32),
                ("samples", ctypes.c_int32), ("paths", ctypes.c_int32), ("threads", ctypes.c_int32),
                ("has_camera", ctypes.c_int32), ("camera", ctypes.c_double * 3), ("look_at", ctypes.c_double * 3),
                ("fov_degrees", ctypes.c_double), ("has_sun", ctypes.c_int32), ("sun", ctypes.c_double * 3)]


class Body(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("mass", ctypes.c_double), ("centre", ctypes.c_double * 3),
                ("inertia", ctypes.c_double * 9), ("voxels", ctypes.c_int64), ("min", ctypes.c_int32 * 3),
                ("extent", ctypes.c_int32 * 3), ("first", ctypes.c_int32 * 3)]


class HitArrays(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("t", ctypes.c_void_p), ("voxel", ctypes.c_void_p),
                ("type", ctypes.c_void_p), ("normal", ctypes.c_void_p)]


class Layer(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("visible", ctypes.c_int32)]


class Sun(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("direction", ctypes.c_double * 3), ("brightness", ctypes.c_double),
                ("colour", ctypes.c_float * 3), ("angle_degrees", ctypes.c_double)]


class Environment(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("sky", ctypes.c_int32), ("sky_brightness", ctypes.c_double),
                ("sky_colour", ctypes.c_float * 3), ("has_background", ctypes.c_int32),
                ("background", ctypes.c_float * 3), ("lamp_brightness", ctypes.c_double),
                ("has_exposure", ctypes.c_int32), ("exposure", ctypes.c_double), ("tone", ctypes.c_int32),
                ("has_ground", ctypes.c_int32), ("ground_height", ctypes.c_double),
                ("ground_colour", ctypes.c_float * 3), ("has_fog", ctypes.c_int32), ("fog_density", ctypes.c_double),
                ("fog_top", ctypes.c_double), ("fog_colour", ctypes.c_float * 3), ("fog_anisotropy", ctypes.c_double)]


Progress = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_double, ctypes.c_void_p)
NO_PROGRESS = ctypes.cast(0, Progress)

_handle, _p, _n, _i = ctypes.c_uint64, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int32
_SIGNATURES = {
    "quoin_free": (_handle,),
    "quoin_scene_create": (_p,),
    "quoin_scene_load": (ctypes.c_char_p, _p),
    "quoin_scene_load_bytes_with": (_p, _n, _p, _p),
    "quoin_scene_load_with": (ctypes.c_char_p, _p, _p),
    "quoin_scene_get_info": (_handle, _p),
    "quoin_set_progress": (Progress, _p),
    "quoin_format_count": (_p,),
    "quoin_format_get": (_n, _p),
    "quoin_scene_save": (_handle, ctypes.c_char_p),
    "quoin_scene_warning_count": (_handle, _p),
    "quoin_scene_warning": (_handle, _n, _p, _n),
    "quoin_type_count": (_handle, _p),
    "quoin_type_get": (_handle, _n, _p),
    "quoin_type_add": (_handle, _p, _p),
    "quoin_type_set": (_handle, _n, _p),
    "quoin_type_set_faces": (_handle, _n, _p),
    "quoin_type_get_orientations": (_handle, _n, _p),
    "quoin_type_set_orientations": (_handle, _n, _p),
    "quoin_orientation_turn": (_i, _i, _i, _p),
    "quoin_type_turned_state": (_handle, _n, ctypes.c_uint32, _i, _p),
    "quoin_type_placed_state": (_handle, _n, _p, ctypes.c_uint32, _p),
    "quoin_type_set_shapes": (_handle, _n, _p),
    "quoin_scene_textures": (_handle, _n, _p),
    "quoin_textures_array_count": (_handle, _p),
    "quoin_textures_array_get": (_handle, _n, _p),
    "quoin_textures_read": (_handle, _n, _i, _p, _n),
    "quoin_textures_faces": (_handle, _n, _p, _p),
    "quoin_textures_shapes": (_handle, _n, _p),
    "quoin_textures_read_shapes": (_handle, _n, _p, _p, _p, _p),
    "quoin_grid_count": (_handle, _p),
    "quoin_grid_get_info": (_handle, _n, _p),
    "quoin_grid_read": (_handle, _n, _p, _p, _p, _n),
    "quoin_grid_add": (_handle, _p, ctypes.c_char_p, _p),
    "quoin_grid_write": (_handle, _n, _p),
    "quoin_grid_read_states": (_handle, _n, _p, _p, _p, _n),
    "quoin_grid_write_states": (_handle, _n, _p),
    "quoin_grid_set_storage": (_handle, _n, _i, _i),
    "quoin_grid_body": (_handle, _n, _p, _n, _p),
    "quoin_grid_pieces": (_handle, _n, _p, _n, _p, _n, _p),
    "quoin_grid_voxelize": (_handle, _p, _p, ctypes.c_char_p, _p),
    "quoin_instance_count": (_handle, _p),
    "quoin_instance_get": (_handle, _n, _p),
    "quoin_instance_add": (_handle, _p, _p),
    "quoin_instance_set": (_handle, _n, _p),
    "quoin_group_count": (_handle, _p),
    "quoin_group_get": (_handle, _n, _p),
    "quoin_camera_count": (_handle, _p),
    "quoin_camera_get": (_handle, _n, _p),
    "quoin_lamp_count": (_handle, _p),
    "quoin_lamp_get": (_handle, _n, _p),
    "quoin_grid_mesh": (_handle, _n, _p, _p),
    "quoin_surface_nets": (_p, ctypes.c_double, _i, _i, _p),
    "quoin_mesh_labels": (_p, ctypes.c_int64, _i, _i, _p),
    "quoin_mesh_view": (_handle, _p),
    "quoin_scene_render": (_handle, _p, _p, _n),
    "quoin_layer_count": (_handle, _p),
    "quoin_layer_get": (_handle, _n, _p),
    "quoin_layer_set": (_handle, _p),
    "quoin_instance_set_layer": (_handle, _n, ctypes.c_char_p),
    "quoin_group_add": (_handle, _p, _p),
    "quoin_camera_add": (_handle, _p),
    "quoin_lamp_add": (_handle, _p),
    "quoin_sun_get": (_handle, _p),
    "quoin_sun_set": (_handle, _p),
    "quoin_environment_get": (_handle, _p),
    "quoin_environment_set": (_handle, _p),
    "quoin_scene_rays": (_handle, _n, _p, _p, ctypes.c_double, _p),
}
for _name, _arguments in _SIGNATURES.items():
    getattr(lib, _name).argtypes = _arguments
    getattr(lib, _name).restype = ctypes.c_int
for _name in ("quoin_version", "quoin_last_error"):
    getattr(lib, _name).argtypes = ()
    getattr(lib, _name).restype = ctypes.c_char_p


class Listener:
    """The progress callback of a `progress` block."""

    def __init__(self, listener: Callable[[float], Any]) -> None:
        self._listener = listener
        self._raised: List[BaseException] = []
        self.is_over = False
        self.function = Progress(self._report)

    def _report(self, fraction: float, _: Any) -> int:
        if self._raised:  # already cancelled
            return 0
        if self.is_over:
            return 1
        try:
            answer = self._listener(fraction)
        except BaseException as error:
            self._raised.append(error)
            return 0
        return 0 if isinstance(answer, (bool, np.bool_)) and not answer else 1

    def raise_what_it_raised(self) -> None:
        """Raises the listener's exception, once."""
        if self._raised:
            raise self._raised.pop()


class Listeners(threading.local):
    """The active listeners of a thread, outermost first. The library calls only the last. The list keeps all alive."""

    def __init__(self) -> None:
        self.all: List[Listener] = []


listeners = Listeners()


def check(status: int) -> None:
    """Raises QuoinError if a call failed. If a listener raised an exception to cancel the call, raises that instead."""
    if status == 0:
        return
    if status == Status.CANCELLED and listeners.all:
        listeners.all[-1].raise_what_it_raised()
    error = QuoinError(lib.quoin_last_error().decode("utf-8", "replace"))
    error.status = Status(status)
    raise error


class Owner:
    """Owns a library handle. Frees it when no Python object refers to this owner any more."""

    def __init__(self, handle: int) -> None:
        self.handle = handle

    def __reduce_ex__(self, protocol: Any) -> Any:
        # A copy would free the handle twice; in another process the handle is invalid.
        raise TypeError("cannot copy or pickle scenes, grids, meshes and textures: save the scene, or copy the arrays")

    def __del__(self) -> None:
        if self.handle:
            lib.quoin_free(self.handle)
            self.handle = 0


def text_of(field: bytes) -> str:
    """Decodes a struct's text field."""
    return field.decode("utf-8", "replace")


def whole(value: Any, name: str, least: int = -2**31, most: int = 2**31 - 1) -> int:
    """Converts to an int. Raises TypeError or ValueError for values that ctypes would silently truncate."""
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an integer, not {type(value).__name__}") from None
    if not least <= found <= most:
        raise ValueError(f"{name}: {found} is out of range")
    return found


def size(value: Any, name: str) -> int:
    """Converts to a size or index, from 0."""
    return whole(value, name, 0, 2 ** (8 * ctypes.sizeof(ctypes.c_size_t)) - 1)


def path_of(path: Any) -> bytes:
    """Encodes a path for the library."""
    found = os.fsencode(path)
    if b"\0" in found:
        raise ValueError("the path contains a NUL character")
    return found


def name_of(text: str) -> bytes:
    """Encodes a name for the library."""
    if not isinstance(text, str):
        raise TypeError(f"a name must be a str, not {type(text).__name__}")
    if "\0" in text:
        raise ValueError("the name contains a NUL character")
    return text.encode("utf-8", "replace")


def bytes_of(text: str, room: int = 128) -> bytes:
    """Encodes a name for a struct field; truncates long names between characters."""
    return name_of(text)[: room - 1].decode("utf-8", "ignore").encode()


def sized(structure: Any) -> Any:
    """Creates a struct with all fields 0, except `size`."""
    made = structure()
    made.size = ctypes.sizeof(structure)
    return made


_SCALARS = {np.dtype(name): number for number, name in enumerate(
    ("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"))}
_SCALARS[np.dtype("bool")] = 0


def number(value: Any, name: str) -> float:
    """Converts to a float; rejects text."""
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}")
    return float(value)


def three(values: Any, name: str) -> List[float]:
    """Converts to a list of three floats."""
    try:
        found = [float(v) for v in values]
    except TypeError:
        found = []
    if len(found) != 3:
        raise ValueError(f"{name} must be three numbers, not {values!r:.80}")
    return found


def types_of(array: Any, origin: Sequence[float]) -> Any:
    """Converts an array of voxel types to a quoin_array, without copying."""
    if isinstance(array, np.ndarray) and array.dtype not in (np.uint8, np.uint16, np.bool_):
        raise TypeError(f"voxel types must be uint8 or uint16, not {array.dtype}; convert the array with astype")
    return array_of(array, (1, 1, 1), origin)


def states_of(array: Any, origin: Sequence[float]) -> Any:
    """Converts an array of voxel states to a quoin_array, without copying."""
    if isinstance(array, np.ndarray) and array.dtype not in (np.uint8, np.uint16, np.uint32):
        raise TypeError(f"voxel states must be uint8, uint16 or uint32, not {array.dtype}; convert the array with "
                        "astype")
    return array_of(array, (1, 1, 1), origin)


def scalar_of(dtype: Any, name: str) -> Tuple[int, bool]:
    """Returns a dtype's quoin_scalar, and True if the dtype is big-endian."""
    found = np.dtype(dtype)
    native = found.newbyteorder("=")
    if native not in _SCALARS:
        raise TypeError(f"{name} of type {found} are not supported")
    return _SCALARS[native], not found.isnative if sys.byteorder == "little" else found.isnative and found.itemsize > 1


def array_of(array: Any, spacing: Sequence[float], origin: Sequence[float]) -> Any:
    """Converts an array to a quoin_array, without copying."""
    if not isinstance(array, np.ndarray):
        raise TypeError("the array must be a NumPy array")
    if array.ndim != 3 or array.size == 0:
        raise ValueError(f"the array must have three non-empty axes, not the shape {array.shape}")
    if array.dtype not in _SCALARS or not array.dtype.isnative:
        raise TypeError(f"arrays of {array.dtype} are not supported; convert the array with astype")
    spacing, origin = three(spacing, "spacing"), three(origin, "origin")
    if not any(array.strides):  # to the library, all 0 means contiguous
        array = array.copy()
    given = sized(Array)
    given.data = array.ctypes.data
    given.scalar = _SCALARS[array.dtype]
    given.shape[:] = array.shape
    given.strides[:] = array.strides
    given.spacing[:], given.origin[:] = spacing, origin
    given.kept = array  # keeps the array alive during the call
    return given


def rows_of(array: Any, width: int, dtype: Any, name: str) -> Any:
    """Converts to a contiguous array (n, width) of a type; copies only if needed."""
    found = np.ascontiguousarray(array, dtype)
    if found.ndim != 2 or found.shape[1] != width:
        raise ValueError(f"{name} must have the shape (n, {width})")
    return found


def indices_of(array: Any, name: str) -> Any:
    """Converts indices to a contiguous uint32 array. Raises TypeError for other numbers, ValueError if out of range."""
    found = np.asarray(array)
    if found.size and found.dtype.kind not in "iu":
        raise TypeError(f"{name} must be integers, not {found.dtype}")
    if found.size and (found.min() < 0 or found.max() > 2**32 - 1):
        raise ValueError(f"{name} must be 0 to 2^32 - 1")
    return np.ascontiguousarray(found, np.uint32)


class _Block:
    # Implements NumPy's array interface for memory of another owner.
    def __init__(self, owner: Any, pointer: int, shape: Tuple[int, ...], dtype: Any) -> None:
        self.owner = owner
        self.__array_interface__ = {"data": (pointer, True), "shape": shape, "typestr": dtype.str, "version": 3}


def view_of(owner: Any, pointer: Optional[int], shape: Tuple[int, ...], dtype: Any) -> Optional[NdArray]:
    """Returns a read-only view of the library's memory, or None for a null pointer. The view keeps `owner` alive."""
    return None if not pointer else np.asarray(_Block(owner, pointer, shape, dtype))
