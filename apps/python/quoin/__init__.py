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

import contextlib
import struct
import zlib
from typing import Any, Callable, Iterator

import numpy as np

from . import _c
from ._c import NdArray, QuoinError
from ._mesh import Mesh, mesh_labels, surface_nets
from ._scene import (Camera, Format, Grid, Group, Heights, Hits, Instance, Lamp, Layer, Raw, Scene, Sun, VoxelType,
                     formats, from_numpy, load, load_bytes)

__all__ = ["Camera", "Format", "Grid", "Group", "Heights", "Hits", "Instance", "Lamp", "Layer", "Mesh", "QuoinError", "Raw",
           "Scene", "Sun", "VoxelType", "formats", "from_numpy", "load", "load_bytes", "mesh_labels", "png", "progress", "surface_nets",
           "version"]


def version() -> str:
    """The library's version.

    >>> version().count(".")
    2
    """
    return _c.text_of(_c.lib.quoin_version())


def png(picture: NdArray) -> bytes:
    """A picture, uint8 (height, width, 3) or (height, width, 4), as a PNG file: for notebooks, and to be written.

    >>> png(np.zeros((2, 3, 3), np.uint8))[:8]
    b'\\x89PNG\\r\\n\\x1a\\n'
    """
    if not isinstance(picture, np.ndarray):
        raise TypeError("a picture is a NumPy array")
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] not in (3, 4) or not picture.size:
        raise ValueError("a picture is uint8, (height, width, 3) or (height, width, 4)")
    height, width, channels = picture.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)  # each begins with its filter: none
    rows[:, 1:] = picture.reshape(height, -1)

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
            + chunk(b"IEND", b""))


@contextlib.contextmanager
def progress(listener: Callable[[float], Any]) -> Iterator[None]:
    """Tells `listener` how far the calls within, of this thread, have come, 0 to 1. It may be called from another
    thread, and ends the call by returning False, or by raising: that call raises the same, or, where it was over
    already, the end of the `with`. Within another `progress` the inner one listens, and after it the outer one again.

    >>> told = []
    >>> with progress(told.append):
    ...     picture = from_numpy(np.ones((4, 4, 4), np.uint8), [(9, 9, 9)]).render(64, 64)
    >>> told[-1]
    1.0
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
    # A generator may be closed on another thread, of whose listeners this one is none. It stays with its own, and is
    # told nothing any more.
    mine.is_over = True
    if mine not in _c.listeners.all:
        return
    was_last = _c.listeners.all[-1] is mine
    _c.listeners.all.remove(mine)
    if was_last:
        former = _c.listeners.all[-1].function if _c.listeners.all else _c.NOBODY
        _c.lib.quoin_set_progress(former, None)
