"""Turns an array of noise into an island: voxels, an image, a mesh and files. Usage: island.py [IMAGE.ppm]"""

import sys

import numpy as np

import quoin

rng = np.random.default_rng(7)
edge = 128
x, z = np.meshgrid(np.arange(edge), np.arange(edge), indexing="ij")
height = np.zeros((edge, edge))
for cells, size in ((4, 22.0), (8, 11.0), (16, 5.0), (32, 2.0)):  # octaves of smooth noise
    lattice = rng.standard_normal((cells + 2, cells + 2))
    u, v = x * cells / edge, z * cells / edge
    i, j = u.astype(int), v.astype(int)
    s, t = (w * w * (3 - 2 * w) for w in (u - i, v - j))
    height += size * ((lattice[i, j] * (1 - s) + lattice[i + 1, j] * s) * (1 - t)
                      + (lattice[i, j + 1] * (1 - s) + lattice[i + 1, j + 1] * s) * t)
height += 34 - 34 * ((x - edge / 2) ** 2 + (z - edge / 2) ** 2) / (edge / 2) ** 2

WATER, SAND, GRASS, ROCK, SNOW = range(1, 6)
y = np.arange(80)[None, :, None]
top = np.clip(height, 2, 78)[:, None, :]
land = np.where(top < 17, SAND, np.where(top < 42, GRASS, np.where(top < 58, ROCK, SNOW)))
voxels = np.where(y < top - 2, ROCK, np.where(y < top, land, np.where(y < 14, WATER, 0))).astype(np.uint8)

scene = quoin.from_numpy(voxels, [
    quoin.VoxelType((60, 130, 190, 90), "water"), (220, 200, 150), (95, 150, 70), (125, 120, 115), (240, 245, 250)])
print(scene.grids[0], scene.grids[0].mesh())
image = scene.render(960, 540, samples=4)
if len(sys.argv) > 1:
    with open(sys.argv[1], "wb") as file:
        file.write(b"P6 960 540 255\n" + image.tobytes())
scene.save("island.vox")
scene.save("island.glb")
