"""Tests of the package; needs only NumPy: `python3 test_quoin.py`. Exits with 77 (skipped) without NumPy."""

import contextlib
import copy
import ctypes
import doctest
import gc
import io
import json
import os
import pathlib
import pickle
import re
import shutil
import sys
import tempfile
import threading
import time
import unittest
import zipfile

try:
    import numpy as np
except ImportError:
    print("NumPy is missing")
    sys.exit(77)

import quoin


CAMERA = quoin.Camera((3, 4, 30), (1, 0, 0), (0, 1, 0), (0, 0, -1), 40.0, focus_distance=12.0, number=2)


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

    def meanwhile(self, call):
        """Counts the turns of another thread during a call. Python's own switch interval is set to 60 s."""
        begun, turns, ended = threading.Event(), 0, False

        def work():
            nonlocal ended
            begun.set()
            call()
            ended = True

        before = sys.getswitchinterval()
        sys.setswitchinterval(60)
        try:
            thread = threading.Thread(target=work)
            thread.start()
            begun.wait()
            while not ended:
                time.sleep(0.001)
                turns += not ended
            thread.join()
        finally:
            sys.setswitchinterval(before)
        return turns

    def test_calls_release_pythons_lock(self):
        array = quoin._c.array_of(ball(160, 60.0).astype(np.float32), (1, 1, 1), (0, 0, 0))
        arguments = ctypes.byref(array), ctypes.c_double(0.0), 1, 1, ctypes.byref(ctypes.c_uint64())
        self.assertGreater(self.meanwhile(lambda: quoin._c.lib.quoin_surface_nets(*arguments)), 0)
        # The check detects calls that keep the lock.
        keeping = ctypes.PyDLL(quoin._c.lib._name)
        self.assertEqual(self.meanwhile(lambda: keeping.quoin_surface_nets(*arguments)), 0)


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

    def test_types_and_bytes_are_taken_as_they_come(self):
        array, scene = self.scene()
        ink = scene.add_type(quoin.VoxelType((1, 2, 3), "ink"))
        self.assertEqual(scene.types[ink].rgba, (1, 2, 3, 255))
        self.assertEqual(scene.types[ink][9:], (0, None, None, 0, True))
        grate = quoin.VoxelType((1, 2, 3, 255), light_cost=3, blocks_light=False, occludes=False)
        added = scene.add_type(grate)
        self.assertEqual(scene.types[added], grate)
        with tempfile.TemporaryDirectory() as folder:
            scene.save(f"{folder}/house.json")
            with open(f"{folder}/house.json", "rb") as file:
                data = file.read()
        for one in (data, bytearray(data), memoryview(data), np.frombuffer(data, np.uint8)):
            self.assertTrue((quoin.load_bytes(one).grids[0].to_numpy() == array[:, :5]).all())

    def test_images_are_put_into_arrays(self):
        _, scene = self.scene()
        out = np.zeros((40, 60, 3), np.uint8)
        self.assertIs(scene.render(60, 40, out=out), out)
        self.assertGreater(out.std(), 5)
        self.assertFalse((scene.render(60, 40, paths=True, samples=2) == out).all())
        self.assertEqual(scene.render(60, 40, camera=(30, 20, 30), look_at=(5, 2, 4)).shape, (40, 60, 3))
        self.assertTrue((scene.render(60, 40, sun=(-0.48, 0.72, 0.5)) == out).all())
        self.assertFalse((scene.render(60, 40, sun=(0.9, 0.1, 0.2)) == out).all())
        with self.assertRaises(quoin.QuoinError):
            scene.render(60, 40, sun=(0, 0, 0))

    def test_rays_in_batches(self):
        array, scene = self.scene()
        x, z = (v.ravel() for v in np.meshgrid(np.arange(10), np.arange(8), indexing="ij"))
        origins = np.stack([x + 0.5, np.full(80, 20.0), z + 0.5], axis=1)
        hits = scene.rays(origins, np.tile([0.0, -1.0, 0.0], (80, 1)))
        height = np.where(array[x, 4, z] > 0, 5, 2)
        self.assertTrue((hits.t == 20 - height).all())
        self.assertTrue((hits.type == np.where(height == 5, 2, 1)).all())
        self.assertTrue((hits.normal == [0, 1, 0]).all())

    def test_bodies_of_grids_and_pieces(self):
        array = np.zeros((6, 2, 1), np.uint8)
        array[:2, 0] = 1
        array[4, :] = 2
        grid = quoin.from_numpy(array, [(255, 0, 0), (0, 255, 0)]).grids[0]
        whole = grid.body([0, 1, 3])
        self.assertEqual((whole.mass, whole.voxel_count, whole.origin, whole.shape), (8, 4, (0, 0, 0), (5, 2, 1)))
        self.assertEqual(whole.centre, (29 / 8, (1 + 6) / 8, 0.5))
        self.assertTrue((whole.inertia == whole.inertia.T).all())
        self.assertEqual(grid.body().mass, 4)
        first, second = grid.pieces((0, 1, 3))
        self.assertEqual((first.mass, first.first), (2, (0, 0, 0)))
        self.assertEqual((second.mass, second.centre, second.origin), (6, (4.5, 1, 0.5), (4, 0, 0)))
        np.testing.assert_allclose(second.inertia, np.diag([2.5, 1, 2.5]), atol=1e-12)
        for wrong in ([-1.0, 1.0], [np.nan]):
            with self.assertRaises(quoin.QuoinError):
                grid.body(wrong)
            with self.assertRaises(quoin.QuoinError):
                grid.pieces(wrong)

    def test_instances_are_placed_and_moved(self):
        _, scene = self.scene()
        twice = np.diag([2.0, 2.0, 2.0, 1.0])
        twice[:3, 3] = 100, 0, 0
        self.assertEqual(scene.place(scene.grids[0], twice, "large", visible=False), 1)
        small, large = scene.instances
        self.assertTrue((small.matrix == np.eye(4)).all() and small.shown)
        self.assertTrue((large.matrix == twice).all())
        self.assertEqual((large.name, large.grid, large.visible, large.group), ("large", 0, False, None))
        self.assertEqual(scene.bounds[1][0], 10)
        scene.move(1, twice, visible=True)
        self.assertEqual(scene.bounds, ((0, 0, 0), (120, 10, 16)))
        self.assertEqual(scene.rays([[101, 50, 1]], [[0, -1, 0]]).t[0], 46)
        with self.assertRaises(quoin.QuoinError):
            scene.move(0, [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]])
        with self.assertRaises(ValueError):
            scene.place(scene.grids[0], np.eye(3))

    def test_quoin_files_leave_out_what_is_not_saved(self):
        _, scene = self.scene()
        scene.place(scene.grids[0], np.eye(4), "shot", saved=False)
        scene.place(scene.grids[0], np.eye(4), "part")
        scene.assign(2, scene.add_group("wreck", saved=False))
        self.assertEqual([one.saved for one in scene.instances], [True, False, True])
        self.assertFalse(scene.groups[0].saved)
        scene.grids[0].whole = True
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/marked.quoin"
            scene.save(path)
            again = quoin.load(path)
            self.assertEqual((len(again.instances), len(again.groups), again.grids[0].whole), (1, 0, True))
            scene.move(1, np.eye(4), saved=True)
            scene.grids[0].whole = False
            scene.save(path)
            again = quoin.load(path)
            self.assertEqual((len(again.instances), again.grids[0].whole, again.grids[0].saved), (2, False, True))
            scene.grids[0].saved = False
            scene.save(path)
            self.assertEqual((len(quoin.load(path).grids), len(scene.grids)), (0, 1))

    def test_scene_files_say_what_else_they_hold(self):
        scene = quoin.load_bytes(b"""{"quoin_scene": 4, "grids": [{"voxels": []}], "layers": [{"name": "upper"}],
            "groups": [{"name": "house"}, {"name": "room", "parent": 0}],
            "instances": [{"grid": 0, "group": 1, "layer": 0}],
            "lamps": [{"position": [1, 2, 3], "intensity": 5}], "sun": [0, 1, 0],
            "camera": {"position": [0, 0, 50], "look_at": [0, 0, 0], "fov": 40}}""")
        self.assertEqual(scene.groups[scene.instances[0].group], quoin.Group("room", 0, True, ""))
        self.assertEqual(scene.instances[0].layer, "upper")
        self.assertEqual((scene.lamps[0].position, scene.lamps[0].direction, scene.sun), ((1, 2, 3), None, (0, 1, 0)))
        camera = scene.cameras[0]
        self.assertEqual((camera.position, camera.forward, camera.view_height), ((0, 0, 50), (0, 0, -1), None))
        self.assertAlmostEqual(camera.fov, 40)

    def test_voxels_of_a_file_are_edited_and_written_back(self):
        array = np.zeros((6, 5, 4), np.uint8)
        array[1:5, 1:4, 1:3] = 1
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.vox")
            quoin.from_numpy(array, [(200, 0, 0), (0, 0, 200)]).save(path)
            scene = quoin.load(path)
            types = scene.grids[0].to_numpy()
            types[types == 1] = 2
            types[0, 0, 0] = 0
            scene.grids[0].write(types)
            scene.grids[0].write(np.ones((2, 1, 1), bool), origin=(-2, 0, 0))
            scene.save(path)
            again = quoin.load(path)
        self.assertEqual(len(again.instances), 1)
        found = again.palette[again.grids[0].to_numpy()][..., :3].reshape(-1, 3).tolist()
        self.assertEqual(found.count([0, 0, 200]), 23)
        self.assertEqual(found.count([200, 0, 0]), 2)

    def test_arrays_of_one_value_have_no_strides(self):
        ones = np.broadcast_to(np.uint8(1), (3, 4, 5))
        self.assertEqual(quoin.from_numpy(ones, [(1, 2, 3)]).grids[0].shape, (3, 4, 5))
        self.assertEqual(len(quoin.mesh_labels(ones).triangles), 2 * 2 * (3 * 4 + 4 * 5 + 5 * 3))

    def test_environment_is_saved_and_rendered(self):
        _, scene = self.scene()
        self.assertEqual(scene.environment, quoin.Environment())
        plain = scene.render(60, 40)
        night = quoin.Environment(
            sky="physical", sky_brightness=0.5, sky_colour=(0.5, 0.25, 1.0), background=(0.0, 0.5, 0.25),
            lamp_brightness=2.0, exposure=0.25, tone="agx", ground=quoin.Ground(-1.0, (0.25, 0.5, 1.0)),
            fog=quoin.Fog(0.5, 8.0, (1.0, 0.5, 0.25), -0.5))
        scene.set_environment(night)
        scene.set_sun(quoin.Sun((0, 1, 1), 0.5))
        self.assertEqual(scene.environment, night)
        dark = scene.render(60, 40)
        self.assertLess(dark.mean(), plain.mean())
        with tempfile.TemporaryDirectory() as folder:
            for ending in (".json", ".quoin", ".vox"):
                path = os.path.join(folder, "night" + ending)
                scene.save(path)
                again = quoin.load(path)
                if ending == ".vox":
                    self.assertTrue(any("render settings" in one for one in scene.warnings), scene.warnings)
                    continue
                self.assertEqual(again.environment, night)
                self.assertTrue((again.render(60, 40) == dark).all(), ending)
        for wrong in (night._replace(sky_brightness=-1.0), night._replace(fog=quoin.Fog(-1.0, 0.0)),
                      night._replace(exposure=float("nan"))):
            with self.assertRaises(quoin.QuoinError):
                scene.set_environment(wrong)
        with self.assertRaises(ValueError):
            scene.set_environment(night._replace(sky="green"))
        self.assertEqual(scene.environment, night)
        scene.set_environment(None)
        self.assertEqual(scene.environment, quoin.Environment())
        self.assertIsNone(scene.sun)
        self.assertTrue((scene.render(60, 40) == plain).all())

    def test_groups_layers_cameras_and_the_sun_come_back(self):
        scene = quoin.from_numpy(np.ones((4, 4, 4), np.uint8), [(9, 9, 9)], "box")
        scene.set_layer("attic", visible=False)
        house = scene.add_group("house")
        room = scene.add_group("room", house, visible=True, layer="attic")
        scene.assign(0, room, "attic")
        flat = CAMERA._replace(view_height=9.0, number=5, position=(1, 2, 90))
        scene.add_camera(CAMERA)
        scene.add_camera(flat)
        scene.set_sun(quoin.Sun((1, 2, 2), 2.5, (1, 0.5, 0.25), 3.0))
        scene.add_lamp(quoin.Lamp("torch", (1, 2, 3), (0, -1, 0), (1, 1, 1), 5.0))
        self.assertRaises(quoin.QuoinError, scene.add_camera, flat)  # the number is taken
        with tempfile.TemporaryDirectory() as folder:
            for ending in (".vox", ".quoin", ".json"):
                path = os.path.join(folder, "all" + ending)
                scene.save(path)
                again = quoin.load(path)
                self.assertEqual([(one.name, one.parent, one.layer) for one in again.groups],
                                 [("house", None, ""), ("room", 0, "attic")])
                self.assertEqual(again.instances[0].layer, "attic")
                self.assertFalse(again.instances[0].shown)
                self.assertIn(quoin.Layer("attic", False), again.layers)
                self.assertEqual(len(again.lamps), 0 if ending == ".vox" else 1)
                self.assertEqual(any("lamps left out" in one for one in scene.warnings), ending == ".vox", scene.warnings)
                sun = again.sun_light
                self.assertTrue(np.allclose(sun.direction, np.array([1, 2, 2]) / 3, atol=1e-6), ending)
                self.assertAlmostEqual(sun.brightness, 2.5, 5)
                self.assertTrue(np.allclose(sun.colour, (1, 0.5, 0.25), atol=5e-3))
                self.assertAlmostEqual(sun.angle, 3.0, 4)
                if ending == ".json":
                    self.assertTrue(any("cameras" in one for one in scene.warnings), scene.warnings)
                    continue
                self.assertEqual([one.number for one in again.cameras], [2, 5])
                for found, wanted in zip(again.cameras, (CAMERA, flat)):
                    self.assertTrue(np.allclose(found.position, wanted.position, atol=1e-4), found)
                    self.assertTrue(np.allclose(found.forward, wanted.forward, atol=1e-6), found)
                self.assertAlmostEqual(again.cameras[0].fov, 40.0, 4)
                self.assertAlmostEqual(again.cameras[0].focus_distance, 12.0, 4)
                self.assertAlmostEqual(again.cameras[1].view_height, 9.0, 4)

    def test_what_a_file_was_given_is_not_lost_in_silence(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.vox")
            quoin.from_numpy(np.ones((4, 4, 4), np.uint8), [(9, 9, 9)]).save(path)
            scene = quoin.load(path)
            scene.add_camera(CAMERA)
            scene.set_sun(quoin.Sun((0, 1, 0), 2.0))
            scene.save(os.path.join(folder, "a.json"))
            self.assertEqual(scene.warnings, ["cameras left out: 1"])
            scene.save(path)
            self.assertEqual(scene.warnings, [])
            again = quoin.load(path)
            again.save(os.path.join(folder, "a.json"))
        self.assertEqual(len(again.cameras), 1)
        self.assertEqual(again.warnings, ["left out, only .vox stores it: cameras: 1",
                                          "left out, only .vox stores it: render settings: 1"])

    def test_triangles_become_voxels(self):
        corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0], [0, 0, 4], [4, 0, 4], [0, 4, 4], [4, 4, 4]])
        cube = [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6],
                [0, 6, 2], [1, 3, 7], [1, 7, 5]]
        scene = quoin.Scene()
        glass = quoin.VoxelType((9, 200, 9, 100), roughness=0.1)
        grid = scene.voxelize(corners, cube, 0.5, types=[(200, 0, 0), glass], materials=[0] * 6 + [1] * 6, fill="solid")
        self.assertEqual((grid.shape, grid.voxel_count), ((8, 8, 8), 512))
        self.assertIn((9, 200, 9, 100), [one.rgba for one in scene.types])
        painted = scene.voxelize(corners, cube, colours=np.tile([0, 0, 1, 1], (8, 1)), fill="surface")
        self.assertTrue((scene.palette[painted.to_numpy()[0, 0, 0]] == [0, 0, 255, 255]).all())
        for wrong in (dict(fill="half"), dict(colours=[[1, 1, 1, 1]]), dict(materials=[0])):
            with self.assertRaises(ValueError):
                scene.voxelize(corners, cube, **wrong)

    def test_progress_is_reported_and_cancels_a_call(self):
        _, scene = self.scene()
        reported = []
        with quoin.progress(reported.append):
            scene.render(64, 64)
        self.assertEqual(reported, sorted(reported))
        self.assertEqual(reported[-1], 1)
        with self.assertRaises(quoin.QuoinError) as ended, quoin.progress(lambda fraction: fraction < 0.5):
            scene.render(64, 64)
        self.assertEqual(ended.exception.status, quoin.Status.CANCELLED)
        with self.assertRaises(ZeroDivisionError), quoin.progress(lambda fraction: 1 / 0):
            scene.render(64, 64)
        self.assertEqual(scene.render(64, 64).shape, (64, 64, 3))
        with self.assertRaises(quoin.QuoinError), quoin.progress(lambda fraction: np.bool_(fraction < 0.5)):
            scene.render(64, 64)

    def test_what_a_listener_raises_at_the_end_is_raised(self):
        _, scene = self.scene()

        def listen(fraction):
            if fraction == 1:
                raise ZeroDivisionError

        with self.assertRaises(ZeroDivisionError), quoin.progress(listen):
            scene.render(64, 64)
        # Later calls do not raise the exception again.
        answers = [KeyError("first")]

        def once(fraction):
            if answers:
                raise answers.pop()

        with quoin.progress(once):
            with self.assertRaises(KeyError):
                scene.render(64, 64)
            with self.assertRaises(quoin.QuoinError):
                quoin.load_bytes(b"VOX nothing")
            scene.render(64, 64)

    def test_values_alone(self):
        place = np.indices((6, 5, 4), np.int16).sum(axis=0, dtype=np.int16)
        mine = quoin.surface_nets(place, 5.5)
        with tempfile.TemporaryDirectory() as folder:
            for dtype in ("<i2", ">i2", "<f4", ">f8", "u1"):
                held = place.astype(dtype).tobytes(order="F")
                raw = quoin.Raw(place.shape, dtype)
                found = quoin.load_bytes(held, raw=raw, iso=5.5).grids[0].mesh(smooth=True)
                self.assertEqual(len(found.triangles), len(mine.triangles), dtype)
                with open(f"{folder}/values.bin", "wb") as file:
                    file.write(held)
                again = quoin.load(f"{folder}/values.bin", raw=raw, iso=5.5).grids[0].mesh(smooth=True)
                self.assertTrue((again.positions == found.positions).all())

    def test_chooses_a_dimension(self):
        world = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tests", "corpus", "cases",
                             "minecraft-26.1-layout")
        if not os.path.exists(world):
            self.skipTest("there is no corpus here")
        with tempfile.TemporaryDirectory() as folder:
            # The overworld gets a region of another world, so that it differs from the nether.
            copied = shutil.copytree(world, f"{folder}/world")
            shutil.copy(os.path.join(world, "..", "minecraft-section-without-longs", "region", "r.0.0.mca"),
                        f"{copied}/dimensions/minecraft/overworld/region/r.0.0.mca")
            voxels = {name: quoin.load(copied, dimension=name).grids[0].voxel_count
                      for name in (None, "", "minecraft:overworld", "nether")}
            self.assertEqual(voxels, {None: 8192, "": 8192, "minecraft:overworld": 8192, "nether": 8704})
            with self.assertRaisesRegex(quoin.QuoinError, "the world has minecraft:overworld, minecraft:the_nether"):
                quoin.load(copied, dimension="end")

    def test_packs_give_blocks_their_looks(self):
        def pack(height):
            """The files of a pack whose stone is a box of that height, in sixteenths."""
            faces = {side: {"texture": "#all"} for side in ("down", "up", "north", "south", "west", "east")}
            model = {"elements": [{"from": [0, 0, 0], "to": [16, height, 16], "faces": faces}]}
            return {"assets/minecraft/blockstates/stone.json": {"variants": {"": {"model": "block/stone"}}},
                    "assets/minecraft/models/block/stone.json": model}

        def zipped(files):
            held = io.BytesIO()
            with zipfile.ZipFile(held, "w") as archive:
                for name, content in files.items():
                    archive.writestr(name, json.dumps(content))
            return held.getvalue()

        def top(loaded):
            return float(loaded.grids[0].mesh().positions[:, 1].max())

        with tempfile.TemporaryDirectory() as folder:
            scene = quoin.Scene()
            scene.add_type(quoin.VoxelType((120, 120, 120), "minecraft:stone"))
            scene.add(np.ones((1, 1, 1), np.uint8))
            house = f"{folder}/house.schem"
            scene.save(house)
            for name, content in pack(8).items():
                os.makedirs(os.path.dirname(f"{folder}/half/{name}"), exist_ok=True)
                with open(f"{folder}/half/{name}", "w") as file:
                    json.dump(content, file)
            with open(f"{folder}/quarter.zip", "wb") as file:
                file.write(zipped(pack(4)))
            half, quarter, eighth = f"{folder}/half", pathlib.Path(folder, "quarter.zip"), zipped(pack(2))
            self.assertEqual(top(quoin.load(house)), 1.0)
            self.assertEqual(top(quoin.load(house, packs=[half])), 0.5)
            self.assertEqual(top(quoin.load(house, packs=[half, quarter])), 0.25)
            self.assertEqual(top(quoin.load(house, packs=(half, quarter, bytearray(eighth)))), 0.125)
            built_in = quoin.load(house, packs=["builtin"])
            self.assertEqual((top(built_in), len(built_in.textures().faces(1))), (1.0, 6))
            with open(house, "rb") as file:
                held = file.read()
            self.assertEqual(top(quoin.load_bytes(held, packs=[memoryview(eighth)])), 0.125)
            # A scene file that names a pack.
            for name, count in (("quarter.zip", 0), ("absent.zip", 1)):
                with open(f"{folder}/scene.json", "w") as file:
                    json.dump({"quoin_scene": 10, "instances": [{"file": "a"}],
                               "files": [{"id": "a", "path": "house.schem", "packs": [{"path": name}]}]}, file)
                loaded = quoin.load(f"{folder}/scene.json")
                self.assertEqual((top(loaded), len([one for one in loaded.warnings if "absent.zip" in one])),
                                 (1.0 if count else 0.25, count))
                self.assertEqual(quoin.load(f"{folder}/scene.json", scene_packs=False).warnings, [])
            with self.assertRaisesRegex(quoin.QuoinError, "absent.zip: No such file"):
                quoin.load(house, packs=[f"{folder}/absent.zip"])
            with self.assertRaisesRegex(quoin.QuoinError, "not a resource pack"):
                quoin.load(house, packs=[b"no zip"])
            with self.assertRaisesRegex(quoin.QuoinError, "empty"):
                quoin.load(house, packs=[""])
            for wrong, error in (("half.zip", TypeError), ([3], TypeError), ([None], TypeError), (["a\0b"], ValueError),
                                 ([eighth, half], ValueError), (eighth, TypeError)):
                with self.assertRaises(error, msg=repr(wrong)[:40]):
                    quoin.load(house, packs=wrong)

    def test_surfaces_have_no_points_where_values_equal_iso(self):
        x, y, z = np.indices((24, 24, 24)) - 11.5
        for dtype in (np.uint8, np.int16, np.float32):
            values = np.round(60.0 - 4.0 * np.sqrt(x * x + y * y + z * z)).clip(0).astype(dtype)
            self.assertGreater(int((values == 30).sum()), 100)
            mesh = quoin.surface_nets(values, 30.0)
            corners = mesh.positions[mesh.triangles].astype(np.float64)
            areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            self.assertGreater(areas.min(), 0.0)

    def test_images_of_heights(self):
        metres = np.array([[3, 5], [4, 9]])
        code = (metres + 10_000) * 10
        image = np.stack([code >> 16, code >> 8 & 255, code & 255], axis=2).astype(np.uint8)
        heights = quoin.Heights("mapbox", metres_per_pixel=1.0, ground_depth=2)
        scene = quoin.load_bytes(quoin.png(image), heights=heights)
        self.assertEqual(scene.warnings, [])
        filled = (scene.grids[0].to_numpy() > 0).sum(axis=1)
        self.assertEqual(sorted(np.diff(sorted(filled.ravel())).tolist()), [1, 1, 4])
        twice = quoin.load_bytes(quoin.png(image), heights=quoin.Heights("mapbox", metres_per_pixel=1.0,
                                                                           exaggeration=2.0, ground_depth=2))
        self.assertGreater(twice.grids[0].shape[1], scene.grids[0].shape[1])
        larger = np.repeat(np.repeat(image, 4, axis=0), 4, axis=1)
        smooth = quoin.load_bytes(quoin.png(larger), heights=quoin.Heights("mapbox", smooth=True))
        self.assertTrue(smooth.grids[0].has_field)
        self.assertIn("metres", " ".join(smooth.warnings))

    def test_progress_within_progress(self):
        _, scene = self.scene()
        outer, inner = [], []
        with quoin.progress(outer.append):
            with quoin.progress(inner.append):
                scene.render(64, 64)
            self.assertFalse(outer)
            scene.render(64, 64)
        self.assertEqual((outer[-1], inner[-1]), (1, 1))
        count = len(outer)
        scene.render(64, 64)
        self.assertEqual(len(outer), count)

    def test_a_listener_may_be_left_on_another_thread(self):
        _, scene = self.scene()
        reported, images = [], []

        def listening():
            with quoin.progress(reported.append):
                yield

        def first():
            generator = listening()
            next(generator)
            thread = threading.Thread(target=generator.close)
            thread.start()
            thread.join()
            del generator
            gc.collect()
            images.append(scene.render(64, 64))

        thread = threading.Thread(target=first)  # its listeners end with it
        thread.start()
        thread.join()
        self.assertEqual((len(images), reported), (1, []))

    def test_a_mesh_of_blocks_says_its_types(self):
        _, scene = self.scene()
        mesh = scene.grids[0].mesh()
        self.assertEqual(set(mesh.types), {1, 2})
        self.assertTrue((scene.palette[mesh.types] == mesh.colours).all())
        self.assertIsNone(scene.grids[0].mesh(smooth=True).types)

    def test_a_watertight_mesh_is_closed(self):
        voxels = np.zeros((6, 6, 6), np.uint16)
        voxels[1:5, 1, 1:5] = 1
        voxels[2, 1:4, 2] = 2  # touches the middle of a face, away from its corners
        grid = quoin.from_numpy(voxels, [(200, 0, 0), (0, 200, 0)]).grids[0]

        def open_edges(mesh):
            _, same = np.unique(mesh.positions, axis=0, return_inverse=True)
            corners = same.reshape(-1)[mesh.triangles]
            edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
            return int((np.unique(edges, axis=0, return_counts=True)[1] % 2).sum())

        self.assertGreater(open_edges(grid.mesh()), 0)
        self.assertEqual(open_edges(grid.mesh(watertight=True)), 0)
        with self.assertRaises((TypeError, ValueError)):
            grid.mesh(watertight="wide")


class Pages(unittest.TestCase):
    """The code in the documentation runs. The source tree has these pages; wheels do not."""

    def page(self, name):
        path = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", name)
        if not os.path.exists(path):
            self.skipTest(f"there is no {name} here")
        with open(path, encoding="utf-8") as file:
            return file.read()

    def run_blocks(self, name):
        values = np.linspace(0, 600, 20 ** 3).reshape(20, 20, 20)
        names = {"volume": values.astype(np.float32), "segmentation": (values // 101).astype(np.int32),
                 "origins": np.array([[5.5, 90.0, 5.5]]), "directions": np.array([[0.0, -1.0, 0.0]])}
        blocks = re.findall(r"```python\n(.*?)```", self.page(name), re.S)
        home = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                Scenes().scene()[1].save("castle.vox")
                for block in blocks:
                    # trimesh is optional, and smaller images suffice.
                    block = "\n".join(line for line in block.split("\n") if "to_trimesh" not in line)
                    block = block.replace("960, 540", "96, 54")
                    with contextlib.redirect_stdout(io.StringIO()):
                        exec(compile(block, name, "exec"), names)
            finally:
                os.chdir(home)
        return len(blocks)

    def test_the_readme(self):
        self.assertGreaterEqual(self.run_blocks("README.md"), 1)

    def test_the_packages_page(self):
        self.assertGreaterEqual(self.run_blocks("docs/python.md"), 3)

    def test_the_notebook(self):
        tour = json.loads(self.page("examples/python/tour.ipynb"))
        cells = [cell for cell in tour["cells"] if cell["cell_type"] == "code"]
        names = {}
        home = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                for cell in cells:
                    with contextlib.redirect_stdout(io.StringIO()):
                        exec(compile("".join(cell["source"]), "tour.ipynb", "exec"), names)
            finally:
                os.chdir(home)
        self.assertTrue(all(cell["execution_count"] for cell in cells), "it was executed")
        images = [output for cell in cells for output in cell["outputs"] if "image/png" in output.get("data", {})]
        self.assertGreaterEqual(len(images), 3)


class Textures(unittest.TestCase):
    def scene(self):
        random = np.random.default_rng(5)
        self.stone = random.integers(0, 256, (16, 16, 3), np.uint8)
        self.glass = random.integers(0, 256, (32, 32, 4), np.uint8)
        scene = quoin.from_numpy(np.ones((3, 1, 1), np.uint8), [(1, 2, 3), (4, 5, 6, 200)])
        side = quoin.Face(self.stone, "stone", turn=3, mirrored=True, tint=(255, 128, 0))
        scene.set_faces(1, (side, side._replace(turn=0), side._replace(image=self.stone[::-1], name="below")))
        scene.set_faces(2, quoin.Face(self.glass[:, ::-1], alpha="translucent"))
        return scene

    def test_shares_of_emission_are_kept(self):
        scene = self.scene()
        bright = quoin.Face(self.stone, "stone")
        dark = bright._replace(emission_share=0)
        scene.set_faces(1, (dark, bright, dark._replace(emission_share=90)))
        self.assertEqual([one.emission_share for one in scene.textures().faces(1)], [0, 0, 255, 90, 0, 0])
        mesh = scene.grids[0].mesh()
        top = mesh.normals[:, 1] > 0.5
        self.assertTrue((mesh.emission_shares[top & (mesh.types == 1)] == 255).all())
        self.assertTrue((mesh.emission_shares[(mesh.normals[:, 2] > 0.5) & (mesh.types == 1)] == 0).all())
        tint = quoin.Face(None, tint=(1, 2, 3), emission_share=7)
        box = quoin.Element(looks={"+X": tint, "-X": (1, 2, 3), "+Y": dark})
        scene.set_shapes(2, quoin.Shapes((quoin.ShapePart((box,)),)))
        looks = scene.textures().shapes(2).parts[0].elements[0].looks
        self.assertEqual((looks["+X"].image, looks["+X"].tint, looks["+X"].emission_share), (None, (1, 2, 3), 7))
        self.assertEqual(looks["-X"], (1, 2, 3))
        self.assertEqual(looks["+Y"].emission_share, 0)
        for wrong in (-1, 256, 0.5):
            with self.assertRaises((ValueError, TypeError, quoin.QuoinError)):
                scene.set_faces(1, bright._replace(emission_share=wrong))
        with self.assertRaises(TypeError):
            scene.set_faces(1, bright._replace(image=None))

    def test_of_types_are_read_back(self):
        textures = self.scene().textures()
        self.assertIsNone(textures.faces(0))
        sides = textures.faces(1)
        self.assertEqual([one.turn for one in sides], [3, 3, 0, 3, 3, 3])
        self.assertEqual([one.name for one in sides], ["stone"] * 3 + ["below"] + ["stone"] * 2)
        self.assertEqual([one.texture for one in sides], [0, 0, 0, 1, 0, 0])
        self.assertEqual(sides[4][2:6], (3, True, (255, 128, 0), "opaque"))
        self.assertTrue((sides[0].image[..., :3] == self.stone).all())
        self.assertTrue((sides[3].image[..., :3] == self.stone[::-1]).all())
        self.assertTrue((sides[3].image[..., 3] == 255).all())
        glass = textures.faces(2)[5]
        self.assertEqual((glass.texture, glass.alpha, glass.name), (65536, "translucent", ""))
        del textures
        gc.collect()
        self.assertTrue((glass.image == self.glass[:, ::-1]).all(), "the view keeps the texels")
        with self.assertRaises(ValueError):
            glass.image[0] = 1

    def test_are_arrays_of_layers(self):
        textures = self.scene().textures()
        small, large = textures.arrays
        self.assertEqual((small.shape, small.dtype, large.shape), ((2, 16, 16, 4), np.uint8, (1, 32, 32, 4)))
        self.assertTrue((small[1, ..., :3] == self.stone[::-1]).all())
        self.assertTrue((large[0] == self.glass[:, ::-1]).all())
        self.assertEqual(textures.level(1, 3).shape, (1, 4, 4, 4))
        for array, level in ((0, 5), (0, -1), (2, 0)):
            with self.assertRaises(quoin.QuoinError):
                textures.level(array, level)

    def test_of_meshes_have_numbers_and_coordinates(self):
        scene = self.scene()
        for textures in (None, scene.textures(max_layers=1)):
            mesh = scene.grids[0].mesh(textures=textures)
            below = mesh.normals[:, 1] < -0.5
            self.assertEqual(set(mesh.textures[below]), {1 if textures is None else 65536})
            self.assertEqual(set(mesh.textures[~below]), {0})
            self.assertEqual(set(map(tuple, mesh.tints)), {(255, 128, 0, 255)})
            top = mesh.normals[:, 1] > 0.5  # right is +Z, down is -X; mirrored
            self.assertTrue((mesh.texture_uvs[top] == -mesh.positions[top][:, [2, 0]]).all())
        smooth = scene.grids[0].mesh(smooth=True)
        self.assertIsNone(smooth.textures)
        scene.set_faces(1, None)
        scene.set_faces(2, None)
        self.assertIsNone(scene.grids[0].mesh().textures)
        self.assertEqual(scene.textures().arrays, [])


class Shapes(unittest.TestCase):
    def scene(self):
        return quoin.from_numpy(np.arange(1, 4, dtype=np.uint8).reshape(3, 1, 1),
                                [(90, 90, 90), quoin.VoxelType((200, 160, 90), "stairs", state_bits=4),
                                 quoin.VoxelType((120, 80, 40, 90), "fence", collides=False)])

    def fence(self):
        bark = quoin.Face(np.full((16, 16, 3), 77, np.uint8), "bark", turn=3, tint=(255, 128, 0))
        post = quoin.Element((6, 0, 6), (10, 16, 10), looks={"+Y": bark, "-Y": (1, 2, 3), "+Z": None},
                             parts={"+Y": (0.0, 0.0, 12.5, -1.0)})
        leaf = quoin.Element((0, 3, 8), (16, 3, 24), quoin.Turn(22.5, 0, (0.0, 3.0, 8.0), True), {"-Y": bark},
                             collides=False)
        arm = quoin.ShapePart((quoin.Element((10, 6, 7), (16, 9, 9)),), quoin.turn_orientation(axis=1, quarter_turns=3),
                              (quoin.Condition(connected=("+Z",), unconnected=("-X", "-Z")),
                               quoin.Condition(state_mask=0, corner="inner_right", positions=(12, 3, 7))))
        return quoin.Shapes((quoin.ShapePart((post, leaf), 29), arm), "connected", 6, False, self.water())

    def water(self):
        return quoin.Fluid(4, (quoin.Condition(), quoin.Condition()))

    def test_are_read_back_and_kept_in_files(self):
        scene, fence = self.scene(), self.fence()
        scene.set_shapes(3, fence)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "fence.json")
            scene.save(path)
            again = quoin.load(path)
        for one in (scene, again):
            found = one.textures().shapes(3)
            self.assertEqual(found[1:], ("connected", 6, False, self.water()))
            self.assertEqual(found.parts[1], fence.parts[1])
            self.assertEqual(found.parts[0].orientation, 29)
            for element, given in zip(found.parts[0].elements, fence.parts[0].elements):
                self.assertEqual((element[:3], element[4:]), (given[:3], given[4:]))
                self.assertEqual(set(element.looks), set(given.looks))
            looks = found.parts[0].elements[0].looks
            self.assertEqual((looks["+Y"].name, looks["+Y"].turn, looks["+Y"].tint, looks["+Y"].texture),
                             ("bark", 3, (255, 128, 0), 0))
            self.assertTrue((looks["+Y"].image[..., :3] == 77).all())
            self.assertEqual((looks["-Y"], looks["+Z"]), ((1, 2, 3), None))
            self.assertIsNone(one.textures().shapes(1))
            self.assertFalse(one.types[3].collides)
        scene.set_shapes(3, None)
        self.assertIsNone(scene.textures().shapes(3))
        scene.set_shapes(3, quoin.Shapes(neighbours="fluid"))
        self.assertEqual(scene.textures().shapes(3), quoin.Shapes(neighbours="fluid"))
        # The water in a stair of the second type, by its state.
        wet = quoin.Shapes((quoin.ShapePart((quoin.Element(max=(16, 8, 16)),)),),
                           fluid=quoin.Fluid(1, (quoin.Condition(1, 1),)))
        scene.set_shapes(2, wet)
        scene.set_shapes(2, scene.textures().shapes(2))
        self.assertEqual(scene.textures().shapes(2).fluid, wet.fluid)

    def test_of_meshes_follow_states(self):
        scene = self.scene()
        scene.set_shapes(2, [quoin.Element(max=(16, 8, 16)), quoin.Element((8, 8, 0), (16, 16, 16))])
        scene.set_orientations(2, quoin.Orientations("about_y_and_upside_down", first_bit=1, front="-Z"))
        self.assertEqual(scene.orientations(2)[1:], (1, "-Z"))
        self.assertIsNone(scene.orientations(1))
        grid = scene.grids[0]

        def top():
            mesh = grid.mesh()
            corners = mesh.positions[(mesh.types == 2) & (mesh.normals[:, 1] > 0.5)].reshape(-1, 4, 3)
            self.assertEqual(mesh.textures.shape, mesh.types.shape)
            return sorted((float(one[:, 0].min()), float(one[0, 1])) for one in corners)

        self.assertEqual(top(), [(1.0, 0.5), (1.5, 1.0)])
        states = np.zeros((3, 1, 1), np.uint8)
        states[1] = 0b100  # a half turn
        grid.write_states(states)
        self.assertEqual(top(), [(1.0, 0.5), (1.0, 1.0)])
        self.assertEqual((grid.states().dtype, grid.states()[:, 0, 0].tolist()), (np.uint32, [0, 4, 0]))
        self.assertEqual(grid.states((1, 0, 0), (1, 1, 1)).tolist(), [[[4]]])
        self.assertEqual(scene.turned_state(2, 4, quoin.turn_orientation(axis=1)), 6)
        # The front turns to +Z.
        self.assertEqual(scene.placed_state(2, "+Y", look=(0, -1, 3), front="away_from_player", state=1), 0b101)
        grid.write_states(np.full((1, 1, 1), 8, np.uint32), (1, 0, 0))
        self.assertEqual(top(), [(1.0, 1.0)])

    def test_stay_when_types_are_replaced(self):
        scene = self.scene()
        scene.set_shapes(2, quoin.Element(max=(16, 8, 16)))
        scene.set_type(2, scene.types[2]._replace(blocks_light=True, name="dark"))
        self.assertEqual((scene.types[2].blocks_light, scene.types[2].name), (True, "dark"))
        self.assertEqual(len(scene.textures().shapes(2).parts), 1)

    def test_tints_of_looks_may_be_lists(self):
        scene = self.scene()
        face = quoin.Face(np.full((16, 16, 3), 77, np.uint8), tint=[255, 128, 0])
        scene.set_shapes(3, quoin.Element(max=(16, 8, 16), looks={"+Y": face, "-Y": face}))
        self.assertEqual(scene.textures().shapes(3).parts[0].elements[0].looks["-Y"].tint, (255, 128, 0))

    def test_orientations_are_matrices(self):
        found = set()
        for axis in range(3):
            for turns in range(-1, 3):
                for first in range(48):
                    one = quoin.turn_orientation(first, axis, turns)
                    quarter = np.round(np.linalg.matrix_power(
                        quoin.orientation_matrix(quoin.turn_orientation(axis=axis)).astype(float), turns)).astype(int)
                    self.assertTrue((quoin.orientation_matrix(one) == quarter @ quoin.orientation_matrix(first)).all())
                    found.add(one)
        self.assertEqual(found, set(range(48)))
        self.assertEqual([round(np.linalg.det(quoin.orientation_matrix(i))) for i in range(48)].count(1), 24)

    def test_errors_change_nothing(self):
        scene = self.scene()
        box, part = quoin.Element(), quoin.ShapePart
        grid = scene.grids[0]
        for wrong, error in [
            (lambda: scene.set_shapes(3, []), quoin.QuoinError),
            (lambda: scene.set_shapes(3, [(1, 2)]), TypeError),
            (lambda: scene.set_shapes(3, quoin.Shapes((box,))), TypeError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,), 0, (1,)),))), TypeError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,)),), "near")), ValueError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,), 48),))), quoin.QuoinError),
            (lambda: scene.set_shapes(3, box._replace(max=(16, 33, 16))), quoin.QuoinError),
            (lambda: scene.set_shapes(3, box._replace(max=(16, float("nan"), 16))), quoin.QuoinError),
            (lambda: scene.set_shapes(3, box._replace(max=(16, 16))), ValueError),
            (lambda: scene.set_shapes(3, box._replace(looks={"up": None})), ValueError),
            (lambda: scene.set_shapes(3, box._replace(looks={"+X": (1, 2)})), ValueError),
            (lambda: scene.set_shapes(3, box._replace(parts={"+X": (1, 2)})), ValueError),
            (lambda: scene.set_shapes(3, [box] * 129), quoin.QuoinError),
            (lambda: scene.set_shapes(0, box), quoin.QuoinError),
            (lambda: scene.set_shapes(2, quoin.Shapes((part((box,), 0, (quoin.Condition(corner="x"),)),))), ValueError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,), 0, (quoin.Condition(1),)),))), quoin.QuoinError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,)),), fluid=(1, ()))), TypeError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,)),), fluid=quoin.Fluid(0))), ValueError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,)),), fluid=quoin.Fluid(
                1, (quoin.Condition(connected=("+X",)),)))), quoin.QuoinError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,), 0, (quoin.Condition(positions=(0, 1, 2)),)),))),
             ValueError),
            (lambda: scene.set_shapes(3, quoin.Shapes((part((box,), 0, (quoin.Condition(positions=(4, 2, 2)),)),))),
             quoin.QuoinError),
            (lambda: scene.set_orientations(3, "about_y"), quoin.QuoinError),
            (lambda: scene.set_orientations(2, "about_z"), ValueError),
            (lambda: scene.set_orientations(2, (0, 1)), TypeError),
            (lambda: scene.set_orientations(2, quoin.Orientations((0, 48))), quoin.QuoinError),
            (lambda: scene.set_orientations(2, quoin.Orientations((0,) * 49)), ValueError),
            (lambda: scene.placed_state(2, "up", (1, 0, 0)), ValueError),
            (lambda: scene.placed_state(2, "+Y", (1, 0, 0), front="left"), ValueError),
            (lambda: scene.placed_state(9, "+Y", (1, 0, 0)), quoin.QuoinError),
            (lambda: scene.turned_state(2, -1, 0), ValueError),
            (lambda: scene.add_type(quoin.VoxelType((1, 2, 3), state_bits=33)), ValueError),
            (lambda: quoin.turn_orientation(48), quoin.QuoinError),
            (lambda: quoin.orientation_matrix(48), ValueError),
            (lambda: grid.write_states(np.full((3, 1, 1), 16, np.uint8)), quoin.QuoinError),
            (lambda: grid.write_states(np.zeros((3, 1, 1), np.int64)), TypeError),
            (lambda: grid.write_states(np.zeros((3, 1), np.uint8)), ValueError),
        ]:
            with self.subTest(wrong), self.assertRaises(error):
                wrong()
        with self.assertRaisesRegex(quoin.QuoinError, "part 1 of the shapes: cannot use element 0 of a shape: "):
            scene.set_shapes(3, quoin.Shapes((part((box,)), part((box._replace(min=(-17, 0, 0)),)))))
        self.assertIsNone(scene.textures().shapes(3))
        self.assertFalse(grid.states().any())


class BadInput(unittest.TestCase):
    def test_raises_and_never_crashes(self):
        array, nan = np.zeros((4, 4, 4), np.uint8), float("nan")
        scene, full = quoin.Scene(), quoin.from_numpy(array + 1, [(1, 2, 3)])
        face = quoin.Face(np.zeros((16, 16, 3), np.uint8))
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
            (lambda: scene.add(array.astype(float)), TypeError),
            (lambda: scene.add(array.astype(int)), TypeError),
            (lambda: quoin.from_numpy(array, (1, 2, 3)), TypeError),
            (lambda: quoin.surface_nets(array, "0.5"), TypeError),
            (lambda: quoin.surface_nets(array, 0.5, spacing=2), ValueError),
            (lambda: full.render(8, 8, look_at=(1, 2, 3)), ValueError),
            (lambda: full.render(8, 8, camera=(1, 2)), ValueError),
            (lambda: full.grids[0].write(array + 9), quoin.QuoinError),
            (lambda: full.grids[0].write(array.astype(int)), TypeError),
            (lambda: quoin.Grid(full, 7).write(array), quoin.QuoinError),
            (lambda: quoin.png([[[0, 0, 0]]]), TypeError),
            (lambda: copy.copy(full._owner), TypeError),
            (lambda: copy.deepcopy(full), TypeError),
            (lambda: pickle.dumps(full), TypeError),
            (lambda: scene.assign(0), quoin.QuoinError),
            (lambda: full.assign(0, 3), quoin.QuoinError),
            (lambda: full.assign(0, None, "nowhere"), quoin.QuoinError),
            (lambda: full.add_group("a", 5), quoin.QuoinError),
            (lambda: full.add_group("a", -1), ValueError),
            (lambda: full.add_group("a", layer="nowhere"), quoin.QuoinError),
            (lambda: full.set_layer(""), quoin.QuoinError),
            (lambda: full.add_camera(CAMERA._replace(right=(2, 0, 0))), quoin.QuoinError),
            (lambda: full.add_camera(CAMERA._replace(right=(-1, 0, 0))), quoin.QuoinError),
            (lambda: full.add_camera(CAMERA._replace(fov=180.0)), quoin.QuoinError),
            (lambda: full.add_camera(CAMERA._replace(view_height=0.0)), quoin.QuoinError),
            (lambda: full.add_camera(CAMERA._replace(number=-1)), quoin.QuoinError),
            (lambda: full.add_camera(CAMERA._replace(position=(nan, 0, 0))), quoin.QuoinError),
            (lambda: full.add_lamp(quoin.Lamp("a", (0, 0, 0), (0, 0, 0), (1, 1, 1), 1.0)), quoin.QuoinError),
            (lambda: full.add_lamp(quoin.Lamp("a", (0, 0, 0), None, (1, 1, 1), -1.0)), quoin.QuoinError),
            (lambda: full.set_sun(quoin.Sun((0, 0, 0))), quoin.QuoinError),
            (lambda: full.set_sun(quoin.Sun((0, 1, 0), nan)), quoin.QuoinError),
            (lambda: scene.add(array, origin=(nan, 0, 0)), quoin.QuoinError),
            (lambda: scene.add_type((1, 2)), ValueError),
            (lambda: scene.add_type((1, 2, 300)), ValueError),
            (lambda: scene.add_type(quoin.VoxelType((1, 2, 3, 255), emission=nan)), quoin.QuoinError),
            (lambda: scene.add_type(quoin.VoxelType((1, 2, 3, 255), light_cost=16)), ValueError),
            (lambda: scene.add_type(quoin.VoxelType((1, 2, 3, 90), occludes=True)), quoin.QuoinError),
            (lambda: scene.save("x.unknown"), quoin.QuoinError),
            (lambda: scene.render(0, 5), ValueError),
            (lambda: scene.render(8, 8, samples=-1), quoin.QuoinError),
            (lambda: scene.render(8, 8, camera=(nan, 0, 0)), quoin.QuoinError),
            (lambda: scene.render(8, 8, out=np.zeros((4, 4, 3), np.uint8)), ValueError),
            (lambda: scene.rays([1, 2, 3], [1, 2, 3]), ValueError),
            (lambda: scene.voxelize([[0, 0, nan]] * 3, [[0, 1, 2]]), quoin.QuoinError),
            (lambda: scene.voxelize([[0, 0, 0]] * 3, [[0, 1, 3]]), quoin.QuoinError),
            (lambda: scene.voxelize([[0, 0, 0]] * 3, [[0, 1]]), ValueError),
            (lambda: scene.voxelize([[0, 0, 0], [1e30, 0, 0], [0, 1, 0]], [[0, 1, 2]]), quoin.QuoinError),
            (lambda: scene.voxelize(np.zeros((0, 3)), np.zeros((0, 3))), quoin.QuoinError),
            (lambda: scene.move(0, np.eye(4)), quoin.QuoinError),
            (lambda: scene.place(quoin.Grid(scene, 7), np.eye(4), "x"), quoin.QuoinError),
            (lambda: quoin.Grid(scene, 7).to_numpy(), quoin.QuoinError),
            (lambda: quoin.Grid(scene, 7).mesh(), quoin.QuoinError),
            (lambda: quoin.load_bytes(b"VOX \x96\0\0\0MAIN"), quoin.QuoinError),
            (lambda: quoin.load("x.vox", frame=-1), quoin.QuoinError),
            (lambda: quoin.load("x.vox", dimension=1), TypeError),
            (lambda: quoin.load("x.vox", dimension="a\0b"), ValueError),
            (lambda: quoin.load("x.obj", size=3, voxel_size=2.0), quoin.QuoinError),
            (lambda: quoin.png(np.zeros((2, 2), np.uint8)), ValueError),
            # Values that ctypes would truncate.
            (lambda: full.grids[0].to_numpy((2**32, 0, 0), (1, 1, 1)), ValueError),
            (lambda: full.grids[0].to_numpy((0.5, 0, 0), (1, 1, 1)), TypeError),
            (lambda: full.render(8, 8, samples=2**32 + 1), ValueError),
            (lambda: full.render(8, 8, samples=1.5), TypeError),
            (lambda: full.render(8, 2**32 + 8), ValueError),
            (lambda: full.render(8, 8, out=[0] * 192), TypeError),
            (lambda: full.move(2**64, np.eye(4)), ValueError),
            (lambda: quoin.mesh_labels(array, background=2**64), ValueError),
            (lambda: scene.voxelize([[0, 0, 0]] * 3, [[0, 1, -1]]), ValueError),
            (lambda: scene.voxelize([[0, 0, 0]] * 3, [[0, 1, 2**32]]), ValueError),
            (lambda: scene.voxelize([[0, 0, 0]] * 3, [[0, 1, 1.5]]), TypeError),
            (lambda: scene.voxelize([[0, 0, 0]] * 3, [[0, 1, 2]], materials=[0.0]), TypeError),
            (lambda: scene.place(full.grids[0], np.eye(4)), ValueError),
            (lambda: scene.add(array + 1, name="a\0b"), ValueError),
            (lambda: full.place(full.grids[0], np.eye(4), "a\0b"), ValueError),
            (lambda: full.place(full.grids[0], np.eye(4), 5), TypeError),
            (lambda: scene.add_type(quoin.VoxelType((1, 2, 3, 4), "a\0b")), ValueError),
            (lambda: scene.add_type((0.5, 0.5, 0.5)), TypeError),
            (lambda: full.set_faces(1, quoin.Face([[0]])), TypeError),
            (lambda: full.set_faces(1, [(1, 2, 3)]), TypeError),
            (lambda: full.set_faces(1, [face, face]), ValueError),
            (lambda: full.set_faces(1, quoin.Face(np.zeros((16, 17, 3), np.uint8))), ValueError),
            (lambda: full.set_faces(1, quoin.Face(np.zeros((16, 16, 3)))), ValueError),
            (lambda: full.set_faces(1, quoin.Face(np.zeros((17, 17, 3), np.uint8))), quoin.QuoinError),
            (lambda: full.set_faces(1, quoin.Face(np.zeros((0, 0, 3), np.uint8))), quoin.QuoinError),
            (lambda: full.set_faces(1, face._replace(turn=4)), quoin.QuoinError),
            (lambda: full.set_faces(1, face._replace(turn=2**32)), ValueError),
            (lambda: full.set_faces(1, face._replace(alpha="glass")), ValueError),
            (lambda: full.set_faces(1, face._replace(alpha="cutout")), quoin.QuoinError),
            (lambda: full.set_faces(1, face._replace(tint=(1, 2))), ValueError),
            (lambda: full.set_faces(1, face._replace(tint=(1, 2, 256))), ValueError),
            (lambda: full.set_faces(1, quoin.Face(np.zeros((16, 16, 4), np.uint8))), quoin.QuoinError),
            (lambda: full.set_faces(0, face), quoin.QuoinError),
            (lambda: full.set_faces(9, None), quoin.QuoinError),
            (lambda: full.textures(-1), ValueError),
            (lambda: full.textures().level(0), quoin.QuoinError),
            (lambda: full.textures().faces(9), quoin.QuoinError),
            (lambda: full.save("a\0b.vox"), ValueError),
            (lambda: quoin.load("a\0b.vox"), ValueError),
            (lambda: quoin.load("a.vox", frame=2**32), ValueError),
            (lambda: quoin.load_bytes("VOX "), TypeError),
            (lambda: quoin.load_bytes(b""), quoin.QuoinError),
            (lambda: quoin.Raw((2, 2)), ValueError),
            (lambda: quoin.Raw((2, 2, 0)), ValueError),
            (lambda: quoin.Raw((2, 2, 2), "complex64"), TypeError),
            (lambda: quoin.Raw((2, 2.5, 2)), TypeError),
            (lambda: quoin.load_bytes(b"1234567", raw=quoin.Raw((2, 2, 2))), quoin.QuoinError),
            (lambda: quoin.load_bytes(b"12345678", raw=(2, 2, 2)), TypeError),
            (lambda: quoin.Heights("colour"), ValueError),
            (lambda: quoin.Heights(metres_per_pixel=0.0), ValueError),
            (lambda: quoin.Heights(exaggeration=nan), ValueError),
            (lambda: quoin.Heights(ground_depth=0), ValueError),
            (lambda: quoin.load_bytes(b"not an image", heights=quoin.Heights()), quoin.QuoinError),
            (lambda: quoin.load_bytes(quoin.png(np.zeros((2, 2, 3), np.uint8)), heights="mapbox"), TypeError),
        ]:
            with self.assertRaises(error):
                wrong()
        self.assertEqual(len(quoin.surface_nets(np.full((4, 4, 4), nan), 0.5).triangles), 0)
        self.assertTrue(np.isinf(scene.rays([[nan, 0, 0]], [[0, 0, 0]]).t).all())


class Package(unittest.TestCase):
    def test_version_matches_the_library(self):
        self.assertIsInstance(quoin.__version__, str)
        self.assertEqual(quoin.__version__, quoin.version())

    def test_all_is_sorted_and_complete(self):
        self.assertEqual(quoin.__all__, sorted(set(quoin.__all__)))
        own = {name for name, value in vars(quoin).items() if not name.startswith("_")
               and getattr(value, "__module__", "").partition(".")[0] == "quoin"}
        self.assertEqual(set(quoin.__all__), own | {"__version__"})

    def test_dir_lists_only_public_names(self):
        listed = dir(quoin)
        plain = {name for name in listed if not (name.startswith("__") and name.endswith("__"))}
        self.assertEqual(plain, set(quoin.__all__) - {"__version__"})
        self.assertTrue({"__all__", "__doc__", "__name__", "__version__"} <= set(listed))
        for name in listed:
            self.assertTrue(hasattr(quoin, name), name)


def load_tests(loader, tests, pattern):
    names = {**vars(quoin), "np": np}
    for module in (quoin, quoin._mesh, quoin._scene, quoin._textures):
        suite = doctest.DocTestSuite(module, extraglobs=names)
        assert suite.countTestCases() > 1, "a module without examples"
        tests.addTests(suite)
    return tests


if __name__ == "__main__":
    unittest.main()
