"""Quoin: voxels as files, NumPy arrays, meshes and images.

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

Voxel arrays have the axes x, y (up) and z, in this order. Coordinates are right-handed. Sizes and positions are in
voxels unless a docstring gives another unit. Colours are sRGB unless marked as linear. `threads=0` uses all processors.

Errors of the library raise QuoinError. Arguments of the wrong type raise TypeError; arrays of the wrong shape and
integers out of range raise ValueError. Calls release Python's global lock while they work.
"""

from __future__ import annotations

import contextlib as _contextlib
import struct as _struct
import zlib as _zlib
from typing import Any, Callable, Iterator, List

import numpy as _np

from . import _c
from ._c import NdArray, QuoinError, Status
from ._mesh import Mesh, mesh_labels, surface_nets
from ._scene import (Body, Camera, Environment, Fog, Format, Grid, Ground, Group, Heights, Hits, Instance, Lamp, Layer,
                     Raw, Scene, Sun, VoxelType, formats, from_numpy, load, load_bytes)
from ._textures import (Condition, Element, Face, Fluid, Orientations, ShapePart, Shapes, Textures, Turn,
                        orientation_matrix, turn_orientation)

__all__ = ["Body", "Camera", "Condition", "Element", "Environment", "Face", "Fluid", "Fog", "Format", "Grid", "Ground",
           "Group", "Heights", "Hits", "Instance", "Lamp", "Layer", "Mesh", "Orientations", "QuoinError", "Raw",
           "Scene", "ShapePart", "Shapes", "Status", "Sun", "Textures", "Turn", "VoxelType", "__version__", "formats",
           "from_numpy", "load", "load_bytes", "mesh_labels", "orientation_matrix", "png", "progress", "surface_nets",
           "turn_orientation", "version"]


def __dir__() -> List[str]:
    # Hides imported modules and private names.
    return sorted({*__all__, *(name for name in globals() if name.startswith("__") and name.endswith("__"))})


def version() -> str:
    """Returns the version of the C library, such as "1.2.3". `quoin.__version__` is the same string.

    >>> version().count(".")
    2
    """
    return _c.text_of(_c.lib.quoin_version())


__version__ = version()


def png(image: NdArray) -> bytes:
    """Encodes an image as a PNG file and returns its bytes.

    `image`: uint8, (height, width, 3) for RGB or (height, width, 4) for RGBA. Raises TypeError if it is not a NumPy
    array, and ValueError for any other dtype or shape and for empty images.

    >>> png(np.zeros((2, 3, 3), np.uint8))[:8]
    b'\\x89PNG\\r\\n\\x1a\\n'
    """
    if not isinstance(image, _np.ndarray):
        raise TypeError("the image must be a NumPy array")
    if image.dtype != _np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4) or not image.size:
        raise ValueError("the image must be uint8, (height, width, 3) or (height, width, 4)")
    height, width, channels = image.shape
    rows = _np.zeros((height, 1 + width * channels), _np.uint8)  # each row starts with its filter type, 0
    rows[:, 1:] = image.reshape(height, -1)

    def chunk(name: bytes, data: bytes) -> bytes:
        return _struct.pack(">I", len(data)) + name + data + _struct.pack(">I", _zlib.crc32(name + data))

    header = _struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", _zlib.compress(rows.tobytes(), 9))
            + chunk(b"IEND", b""))


@_contextlib.contextmanager
def progress(listener: Callable[[float], Any]) -> Iterator[None]:
    """Reports the progress of calls that this thread makes inside the `with` block.

    `listener` receives the finished fraction of the current call, 0 to 1. Quoin may call it from another thread. To
    cancel the current call, return False, which raises QuoinError with Status.CANCELLED, or raise an exception, which
    the call raises too. If the call has already finished, the end of the `with` block raises the exception. Blocks can
    be nested: only the innermost listener is called.
    """
    mine = _c.Listener(listener)
    _c.check(_c.lib.quoin_set_progress(mine.function, None))
    _c.listeners.all.append(mine)
    try:
        yield
    finally:
        _leave(mine)
    mine.raise_what_it_raised()


def _leave(mine: _c.Listener) -> None:
    # A generator may be closed on another thread, which lacks this listener. It stays registered on its own thread but
    # ignores calls.
    mine.is_over = True
    if mine not in _c.listeners.all:
        return
    was_last = _c.listeners.all[-1] is mine
    _c.listeners.all.remove(mine)
    if was_last:
        former = _c.listeners.all[-1].function if _c.listeners.all else _c.NO_PROGRESS
        _c.lib.quoin_set_progress(former, None)
