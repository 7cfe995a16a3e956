"""Quoin's axes are +Y up, Blender's +Z: (x, y, z) is (x, -z, y) there. Handed alike."""

import numpy as np

BLENDER_FROM_QUOIN = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
QUOIN_FROM_BLENDER = BLENDER_FROM_QUOIN.T


def points_to_blender(points, scale):
    """Points (n, 3) of a grid, in voxels, as a mesh has them; float32 without gaps."""
    out = np.empty(points.shape, np.float32)
    out[:, 0] = points[:, 0]
    np.negative(points[:, 2], out=out[:, 1])
    out[:, 2] = points[:, 1]
    out *= np.float32(scale)
    return out


def points_to_quoin(points, scale):
    """Points (n, 3) in Blender's world as Quoin's, in units of a voxel of that size."""
    return np.ascontiguousarray(np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1) / scale, np.float32)


def matrix_to_blender(matrix, scale):
    """The matrix (4, 4) of an object whose mesh is a grid's, in units of `scale`."""
    out = BLENDER_FROM_QUOIN @ matrix @ QUOIN_FROM_BLENDER
    out[:3, 3] *= scale
    return out


def matrix_to_quoin(matrix, mesh_scale, scale):
    """The inverse, for a mesh in units of `mesh_scale` and a world in units of `scale`; whole numbers where it is
    close."""
    out = QUOIN_FROM_BLENDER @ matrix @ BLENDER_FROM_QUOIN
    out[:3, :3] *= mesh_scale / scale
    out[:3, 3] /= scale
    whole = np.round(out)
    close = np.abs(out - whole) < 1e-3
    close[:3, :3] = np.abs(out - whole)[:3, :3] < 1e-5
    return np.where(close, whole, out)
