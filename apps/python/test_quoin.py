"""Tests of the package, with nothing but NumPy: `python3 test_quoin.py`. They are skipped (77) where that is missing."""

import doctest
import gc
import sys
import tempfile
import threading
import time
import unittest

try:
    import numpy as np
except ImportError:
    print("NumPy is missing")
    sys.exit(77)

import quoin


def ball(edge=24, radius=8.0):
    x, y, z = np.indices((edge,) * 3) - (edge - 1) / 2
    return np.sqrt(x * x + y * y + z * z) - radius


class Meshes(unittest.TestCase):
    def test_arrays_are_views_of_the_librarys_memory(self):
        mesh = quoin.surface_nets(ball().astype(np.float32), 0.0, solid="below")
        data = quoin._c.sized(quoin._c.MeshData)
        quoin._c.check(quoin._c.lib.quoin_mesh_view(mesh._owner.handle, quoin._c.ctypes.byref(data)))
        self.assertEqual(mesh.positions.ctypes.data, data.positions)
        self.assertEqual(mesh.normals.ctypes.data, data.normals)
        self.assertEqual(mesh.triangles.ctypes.data, data.indices)
        with self.assertRaises(ValueError):
            mesh.positions[0] = 1

    def test_a_view_outlives_its_mesh(self):
        mesh = quoin.surface_nets(ball(), 0.0, solid="below")
        positions, wanted = mesh.positions[5:], mesh.positions[5:].copy()
        handle = mesh._owner.handle
        del mesh
        gc.collect()
        self.assertTrue((positions == wanted).all())
        del positions
        gc.collect()
        self.assertEqual(quoin._c.lib.quoin_free(handle), 9, "freed with the last view")

    def test_strides_and_types_are_read_as_they_lie(self):
        base = ball()
        wanted = quoin.surface_nets(base, 0.0, solid="below")
        whole = np.zeros((48, 24, 48))
        whole[::2, :, ::2] = base
        for array in (np.asfortranarray(base), whole[::2, :, ::2], base[::-1][::-1]):
            self.assertTrue(np.allclose(np.sort(quoin.surface_nets(array, 0.0, solid="below").positions, axis=0),
                                        np.sort(wanted.positions, axis=0)))
        self.assertEqual(len(quoin.surface_nets((base < 0), 0.5).triangles), len(wanted.triangles))

    def test_labels_share_their_faces(self):
        array = np.zeros((12, 12, 12), np.int32)
        array[2:10, 2:10, 2:6], array[2:10, 2:10, 6:10] = 5, -3
        mesh = quoin.mesh_labels(array)
        self.assertEqual({tuple(row[:2]) for row in mesh.interfaces}, {(5, 0), (-3, 0), (5, -3)})
        for label in (5, -3):
            triangles = mesh.of_label(label).astype(int)
            a, b, c = (mesh.positions[triangles[:, i]].astype(float) for i in range(3))
            self.assertGreater(np.einsum("ij,ij->i", a, np.cross(b, c)).sum(), 0, "turned outwards")

    def test_python_goes_on_meanwhile(self):
        array = ball(200, 80.0).astype(np.float32)
        counted = []
        work = threading.Thread(target=lambda: [quoin.surface_nets(array, 0.0, solid="below") for _ in range(3)])
        work.start()
        while work.is_alive():
            counted.append(1)
            time.sleep(0.0005)
        self.assertGreater(len(counted), 3)


class Scenes(unittest.TestCase):
    def scene(self):
        array = np.zeros((10, 6, 8), np.uint16)
        array[:, :2] = 1
        array[4:6, 2:5, 3:5] = 2
        return array, quoin.from_numpy(array, [(90, 150, 70), quoin.VoxelType((200, 60, 40, 255), "brick")], "house")

    def test_files_keep_arrays(self):
        array, scene = self.scene()
        with tempfile.TemporaryDirectory() as folder:
            for ending in ("json", "vox"):
                scene.save(f"{folder}/house.{ending}")
                again = quoin.load(f"{folder}/house.{ending}")
                grid = again.grids[0]
                self.assertEqual(grid.shape, (10, 5, 8))
                self.assertTrue((again.palette[grid.to_numpy()][..., :3] == scene.palette[array[:, :5]][..., :3]).all())
            scene.save(f"{folder}/house.glb")
        self.assertEqual(scene.grids[0].name, "house")
        self.assertEqual(scene.types[2].name, "brick")

    def test_boxes_are_read(self):
        array, scene = self.scene()
        box = scene.grids[0].to_numpy((-1, -1, -1), (12, 8, 10))
        self.assertTrue((box[1:11, 1:7, 1:9] == array).all())
        self.assertEqual(int(box.astype(bool).sum()), int(array.astype(bool).sum()))

    def test_pictures_are_put_into_arrays(self):
        _, scene = self.scene()
        out = np.zeros((40, 60, 3), np.uint8)
        self.assertIs(scene.render(60, 40, out=out), out)
        self.assertGreater(out.std(), 5)
        self.assertFalse((scene.render(60, 40, paths=True, samples=2) == out).all())
        self.assertEqual(scene.render(60, 40, camera=(30, 20, 30), look_at=(5, 2, 4)).shape, (40, 60, 3))

    def test_rays_in_batches(self):
        array, scene = self.scene()
        x, z = (v.ravel() for v in np.meshgrid(np.arange(10), np.arange(8), indexing="ij"))
        origins = np.stack([x + 0.5, np.full(80, 20.0), z + 0.5], axis=1)
        hits = scene.rays(origins, np.tile([0.0, -1.0, 0.0], (80, 1)))
        height = np.where(array[x, 4, z] > 0, 5, 2)
        self.assertTrue((hits.t == 20 - height).all())
        self.assertTrue((hits.type == np.where(height == 5, 2, 1)).all())
        self.assertTrue((hits.normal == [0, 1, 0]).all())


class BadInput(unittest.TestCase):
    def test_is_told_and_never_a_crash(self):
        array, nan = np.zeros((4, 4, 4), np.uint8), float("nan")
        scene = quoin.Scene()
        for wrong, error in [
            (lambda: quoin.surface_nets(array[0], 0.5), ValueError),
            (lambda: quoin.surface_nets(array[:0], 0.5), ValueError),
            (lambda: quoin.surface_nets([[1]], 0.5), TypeError),
            (lambda: quoin.surface_nets(array.astype(">f4"), 0.5), TypeError),
            (lambda: quoin.surface_nets(array.astype(complex), 0.5), TypeError),
            (lambda: quoin.surface_nets(array, nan), quoin.QuoinError),
            (lambda: quoin.surface_nets(array, 0.5, spacing=(1, nan, 1)), quoin.QuoinError),
            (lambda: quoin.surface_nets(array, 0.5, spacing=(1, 0, 1)), quoin.QuoinError),
            (lambda: quoin.mesh_labels(array.astype(float)), quoin.QuoinError),
            (lambda: quoin.mesh_labels(array, relaxation_steps=-1), quoin.QuoinError),
            (lambda: scene.add(array + 9), quoin.QuoinError),
            (lambda: scene.add(array.astype(float)), quoin.QuoinError),
            (lambda: scene.add(array, origin=(nan, 0, 0)), quoin.QuoinError),
            (lambda: scene.add_type((1, 2)), ValueError),
            (lambda: scene.add_type((1, 2, 300)), ValueError),
            (lambda: scene.add_type(quoin.VoxelType((1, 2, 3, 255), emission=nan)), quoin.QuoinError),
            (lambda: scene.save("x.unknown"), quoin.QuoinError),
            (lambda: scene.render(0, 5), ValueError),
            (lambda: scene.render(8, 8, samples=-1), quoin.QuoinError),
            (lambda: scene.render(8, 8, camera=(nan, 0, 0)), quoin.QuoinError),
            (lambda: scene.render(8, 8, out=np.zeros((4, 4, 3), np.uint8)), ValueError),
            (lambda: scene.rays([1, 2, 3], [1, 2, 3]), ValueError),
        ]:
            with self.assertRaises(error):
                wrong()
        self.assertEqual(len(quoin.surface_nets(np.full((4, 4, 4), nan), 0.5).triangles), 0)
        self.assertTrue(np.isinf(scene.rays([[nan, 0, 0]], [[0, 0, 0]]).t).all())


def load_tests(loader, tests, pattern):
    tests.addTests(doctest.DocTestSuite(quoin))
    return tests


if __name__ == "__main__":
    unittest.main()
