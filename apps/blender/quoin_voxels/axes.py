"""Converts axes: +Y is up in Quoin, +Z in Blender. (x, y, z) becomes (x, -z, y). Both are right-handed."""

import numpy as np

BLENDER_FROM_QUOIN = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
QUOIN_FROM_BLENDER = BLENDER_FROM_QUOIN.T


def points_to_blender(points, scale):
    """Converts grid points (n, 3), in voxels, to mesh coordinates; contiguous float32."""
    out = np.empty(points.shape, np.float32)
    out[:, 0] = points[:, 0]
    np.negative(points[:, 2], out=out[:, 1])
    out[:, 2] = points[:, 1]
    out *= np.float32(scale)
    return out


def points_to_quoin(points, scale):
    """Converts points (n, 3) of Blender's world to voxel units; `scale` is the voxel size."""
    return np.ascontiguousarray(np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1) / scale, np.float32)


def matrix_to_blender(matrix, scale):
    """Converts an instance's matrix (4, 4) to that of a Blender object; `scale` is the voxel size."""
    out = BLENDER_FROM_QUOIN @ matrix @ QUOIN_FROM_BLENDER
    out[:3, 3] *= scale
    return out


def matrix_to_quoin(matrix, mesh_scale, scale):
    """The inverse, for a mesh in units of `mesh_scale` and a world in units of `scale`. Rounds entries that are close
    to integers."""
    out = QUOIN_FROM_BLENDER @ matrix @ BLENDER_FROM_QUOIN
    out[:3, :3] *= mesh_scale / scale
    out[:3, 3] /= scale
    whole = np.round(out)
    close = np.abs(out - whole) < 1e-3
    close[:3, :3] = np.abs(out - whole)[:3, :3] < 1e-5
    return np.where(close, whole, out)
