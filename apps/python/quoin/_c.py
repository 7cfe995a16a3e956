"""quoin.h by ctypes. Every call releases Python's lock while it runs."""

from __future__ import annotations

import ctypes
import os
from typing import Any, Optional, Sequence, Tuple

import numpy as np


class QuoinError(Exception):
    """What the library could not do, in one line; `status` is quoin_status."""

    status = 0


def _find() -> ctypes.CDLL:
    beside = os.path.join(os.path.dirname(__file__), "libquoin_c.so.0")
    return ctypes.CDLL(os.environ.get("QUOIN_LIBRARY") or (beside if os.path.exists(beside) else "libquoin_c.so.0"))


lib = _find()


class Array(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("data", ctypes.c_void_p), ("scalar", ctypes.c_int32),
                ("shape", ctypes.c_int64 * 3), ("strides", ctypes.c_int64 * 3), ("spacing", ctypes.c_double * 3),
                ("origin", ctypes.c_double * 3)]


class GridInfo(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char * 128), ("voxels", ctypes.c_int64),
                ("min", ctypes.c_int32 * 3), ("extent", ctypes.c_int32 * 3), ("has_field", ctypes.c_int32)]


class Type(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("rgba", ctypes.c_uint8 * 4), ("emission", ctypes.c_float),
                ("metalness", ctypes.c_float), ("roughness", ctypes.c_float), ("name", ctypes.c_char * 128)]


class MeshData(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("vertex_count", ctypes.c_size_t), ("index_count", ctypes.c_size_t),
                ("interface_count", ctypes.c_size_t), ("positions", ctypes.c_void_p), ("normals", ctypes.c_void_p),
                ("colours", ctypes.c_void_p), ("occlusion", ctypes.c_void_p), ("indices", ctypes.c_void_p),
                ("interfaces", ctypes.c_void_p)]


class MeshOptions(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("smooth", ctypes.c_int32), ("no_occlusion", ctypes.c_int32),
                ("threads", ctypes.c_int32)]


class RenderOptions(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("width", ctypes.c_int32), ("height", ctypes.c_int32),
                ("samples", ctypes.c_int32), ("paths", ctypes.c_int32), ("threads", ctypes.c_int32),
                ("has_camera", ctypes.c_int32), ("camera", ctypes.c_double * 3), ("look_at", ctypes.c_double * 3),
                ("fov_degrees", ctypes.c_double)]


class HitArrays(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("t", ctypes.c_void_p), ("voxel", ctypes.c_void_p),
                ("type", ctypes.c_void_p), ("normal", ctypes.c_void_p)]


_handle, _p, _n, _i = ctypes.c_uint64, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int32
_SIGNATURES = {
    "quoin_free": (_handle,),
    "quoin_scene_create": (_p,),
    "quoin_scene_load": (ctypes.c_char_p, _p),
    "quoin_scene_load_bytes": (_p, _n, _p),
    "quoin_scene_save": (_handle, ctypes.c_char_p),
    "quoin_scene_warning_count": (_handle, _p),
    "quoin_scene_warning": (_handle, _n, _p, _n),
    "quoin_type_count": (_handle, _p),
    "quoin_type_get": (_handle, _n, _p),
    "quoin_type_add": (_handle, _p, _p),
    "quoin_grid_count": (_handle, _p),
    "quoin_grid_get_info": (_handle, _n, _p),
    "quoin_grid_read": (_handle, _n, _p, _p, _p, _n),
    "quoin_grid_add": (_handle, _p, ctypes.c_char_p, _p),
    "quoin_grid_mesh": (_handle, _n, _p, _p),
    "quoin_surface_nets": (_p, ctypes.c_double, _i, _i, _p),
    "quoin_mesh_labels": (_p, ctypes.c_int64, _i, _i, _p),
    "quoin_mesh_view": (_handle, _p),
    "quoin_scene_render": (_handle, _p, _p, _n),
    "quoin_scene_rays": (_handle, _n, _p, _p, ctypes.c_double, _p),
}
for _name, _arguments in _SIGNATURES.items():
    getattr(lib, _name).argtypes = _arguments
    getattr(lib, _name).restype = ctypes.c_int
for _name in ("quoin_version", "quoin_last_error"):
    getattr(lib, _name).argtypes = ()
    getattr(lib, _name).restype = ctypes.c_char_p


def check(status: int) -> None:
    """Raises what a status says, with the library's words."""
    if status == 0:
        return
    error = QuoinError(lib.quoin_last_error().decode("utf-8", "replace"))
    error.status = status
    raise error


def sized(structure: Any) -> Any:
    """An empty struct that knows its size."""
    made = structure()
    made.size = ctypes.sizeof(structure)
    return made


_SCALARS = {np.dtype(name): number for number, name in enumerate(
    ("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"))}
_SCALARS[np.dtype("bool")] = 0


def array_of(array: Any, spacing: Sequence[float], origin: Sequence[float]) -> Any:
    """An array as the library reads it, where it lies."""
    if not isinstance(array, np.ndarray):
        raise TypeError("a NumPy array is needed")
    if array.ndim != 3 or array.size == 0:
        raise ValueError(f"the array has the shape {array.shape}, and is to have three axes that are not empty")
    if array.dtype not in _SCALARS or not array.dtype.isnative:
        raise TypeError(f"arrays of {array.dtype} are not read; convert it with astype")
    if len(spacing) != 3 or len(origin) != 3:
        raise ValueError("spacing and origin are three numbers")
    given = sized(Array)
    given.data = array.ctypes.data
    given.scalar = _SCALARS[array.dtype]
    given.shape[:] = array.shape
    given.strides[:] = array.strides
    given.spacing[:] = [float(v) for v in spacing]
    given.origin[:] = [float(v) for v in origin]
    given.kept = array  # until the call is over
    return given


class _Block:
    # What NumPy asks for memory that another owns.
    def __init__(self, owner: Any, pointer: int, shape: Tuple[int, ...], dtype: Any) -> None:
        self.owner = owner
        self.__array_interface__ = {"data": (pointer, True), "shape": shape, "typestr": dtype.str, "version": 3}


def view_of(owner: Any, pointer: Optional[int], shape: Tuple[int, ...], dtype: Any) -> Optional[np.ndarray]:
    """The library's own memory as a read-only array, which keeps `owner` alive."""
    return None if not pointer else np.asarray(_Block(owner, pointer, shape, dtype))
