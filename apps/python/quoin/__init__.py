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
from typing import Any, Callable, Iterator, List

from . import _c
from ._c import QuoinError
from ._mesh import Mesh, mesh_labels, surface_nets
from ._scene import (Camera, Format, Grid, Group, Hits, Instance, Lamp, Scene, VoxelType, formats, from_numpy, load,
                     load_bytes)

__all__ = ["Camera", "Format", "Grid", "Group", "Hits", "Instance", "Lamp", "Mesh", "QuoinError", "Scene", "VoxelType",
           "formats", "from_numpy", "load", "load_bytes", "mesh_labels", "progress", "surface_nets", "version"]


def version() -> str:
    """The library's version.

    >>> version().count(".")
    2
    """
    return _c.text_of(_c.lib.quoin_version())


@contextlib.contextmanager
def progress(listener: Callable[[float], Any]) -> Iterator[None]:
    """Tells `listener` how far the calls within have come, 0 to 1. It may be called from another thread, and ends the
    call by returning False, or by raising: that call then raises.

    >>> told = []
    >>> with progress(told.append):
    ...     picture = from_numpy(np.ones((4, 4, 4), np.uint8), [(9, 9, 9)]).render(64, 64)
    >>> told[-1]
    1.0
    """
    raised: List[BaseException] = []

    def tell(fraction: float, _: Any) -> int:
        try:
            return 0 if listener(fraction) is False else 1
        except BaseException as error:
            raised.append(error)
            return 0

    function = _c.Progress(tell)
    _c.check(_c.lib.quoin_set_progress(function, None))
    try:
        yield
    except QuoinError:
        if raised:
            raise raised[0]
        raise
    finally:
        _c.lib.quoin_set_progress(_c.NOBODY, None)
