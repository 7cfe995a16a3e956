"""Installs the add-on's zip into a fresh profile and tests import, export and errors.

Run: blender -b --factory-startup -P check_addon.py -- ADDON.zip CASTLE.vox FOLDER
with BLENDER_USER_CONFIG and BLENDER_USER_SCRIPTS in an empty folder. Output goes to FOLDER.
Exit status: 0 all right, 1 not.
"""

import json
import math
import os
import sys
import time
import traceback

import bpy
import numpy as np
from mathutils import Vector

SCENE_FILE = """{"quoin_scene": 5,
  "types": [{"name": "gold", "colour": [250, 200, 60, 255], "metalness": 1, "roughness": 0.25},
            {"name": "glass", "colour": [10, 200, 250, 90], "visibility": "transparent", "ior": 1.33, "roughness": 0},
            {"name": "lamp", "colour": [255, 240, 200, 255], "emission": 8}],
  "grids": [%s],
  "groups": [{"name": "house"}, {"name": "room", "parent": 0}],
  "layers": [{"name": "attic", "visible": false}],
  "instances": [{"grid": 0, "name": "first", "group": 1},
                {"grid": 0, "name": "turned", "position": [20, 0, 0], "rotation": {"axis": [0, 1, 0], "degrees": 90}},
                {"grid": 0, "name": "slanting", "position": [40, 0, 0], "rotation": {"axis": [0, 1, 0], "degrees": 30}},
                {"grid": 0, "name": "away", "position": [60, 0, 0], "layer": 0}],
  "lamps": [{"name": "torch", "kind": "spot", "position": [1, 2, 3], "direction": [0, -1, 0], "intensity": 5}],
  "sun": [0, 1, 0],
  "camera": {"position": [10, 20, 50], "look_at": [10, 20, 0], "fov": 40}}"""


def require(condition, message):
    if not condition:
        raise AssertionError(message)


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="quoin_voxels")


def run(operator, **options):
    require(operator(**options) == {"FINISHED"}, f"{operator} did not finish")


def refused(operator, words, **options):
    """Checks that an operator fails with these words. Blender in the background raises reported errors."""
    try:
        operator(**options)
    except RuntimeError as error:
        require(words in str(error), f"{operator}: {error}")
    else:
        raise AssertionError(f"{operator} says nothing of {options}")


def points_of(scene):
    """Returns all visible voxels of a scene as sorted rows of position and colour."""
    rows = []
    grids = [(one.to_numpy(), one.origin) for one in scene.grids]
    for one in scene.instances:
        if not one.shown:
            continue
        types, origin = grids[one.grid]
        at = np.argwhere(types)
        centres = (at + origin + 0.5) @ one.matrix[:3, :3].T + one.matrix[:3, 3]
        rows.append(np.concatenate([np.floor(centres), scene.palette[types[tuple(at.T)]]], axis=1))
    rows = np.unique(np.concatenate(rows).astype(np.int64), axis=0)
    return rows


def check_castle(quoin, path, folder):
    empty()
    begin = time.perf_counter()
    run(bpy.ops.import_scene.quoin, filepath=path)
    print(f"the castle in {time.perf_counter() - begin:.2f} s")
    scene = quoin.load(path)
    placed = [one for one in scene.instances if scene.grids[one.grid].voxel_count]
    objects = [one for one in bpy.data.objects if one.type == "MESH"]
    require(len(objects) == len(placed), f"{len(objects)} objects of {len(placed)} instances")
    require(len({one.data.name for one in objects}) == len({one.grid for one in placed}), "instances share meshes")
    bpy.context.view_layer.update()
    corners = np.array([one.matrix_world @ Vector(c) for one in objects for c in one.bound_box])
    least, most = (np.array(one) * 0.1 for one in scene.bounds)
    # Quoin's y is Blender's z, its z Blender's -y.
    require(np.allclose(corners.min(0), [least[0], -most[2], least[1]], atol=1e-4), f"from {corners.min(0)}")
    require(np.allclose(corners.max(0), [most[0], -least[2], most[1]], atol=1e-4), f"to {corners.max(0)}")
    for mesh in bpy.data.meshes:
        require(not mesh.validate(), f"{mesh.name} is not valid")
        check_mesh(mesh, next(one for one in scene.grids if one.name == mesh.name).mesh())

    for name, engine in (("castle.vox", quoin.load), ("castle.json", quoin.load)):
        run(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, name))
        again = engine(os.path.join(folder, name))
        require(np.array_equal(points_of(again), points_of(scene)), f"{name} has other voxels")
        require(len(again.instances) == len(placed) and len(again.grids) == len({one.grid for one in placed}),
                f"{name}: {len(again.grids)} grids, {len(again.instances)} instances")
        require({one.name for one in again.instances} == {one.name for one in placed}, f"{name}: names")
        # Compares properties, since type numbers may differ.
        looks = lambda of: {tuple(round(float(v), 4) for v in (*one.rgba, one.emission, one.metalness, one.roughness))
                            for one in of.types[1:] }
        require(looks(again) <= looks(scene), f"{name}: types {looks(again) - looks(scene)}")

    # The voxels survive saving the .blend.
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "castle.blend"))
    bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "castle.blend"))
    run(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "again.vox"))
    require(np.array_equal(points_of(quoin.load(os.path.join(folder, "again.vox"))), points_of(scene)), "the .blend")


def check_mesh(mesh, wanted):
    """Faces cover whole voxels, face outwards and have their types' colours and occlusion, as in the library."""
    values = np.empty(len(mesh.vertices) * 4, np.float32)
    mesh.color_attributes["Occlusion"].data.foreach_get("color", values)
    found = np.unique(values)
    require(set(np.round(found, 4)) <= {0.25, 0.5, 0.75, 1.0}, f"{mesh.name}: occlusion {found}")
    require(len(found) > 1, f"{mesh.name} has no occlusion")
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    points = points.astype(float)
    require(np.allclose(points / 0.1, np.round(points / 0.1), atol=1e-3), f"{mesh.name}: corners between voxels")
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    a, b, c, d = (points[corners.reshape(-1, 4)[:, i]] for i in range(4))
    areas = np.linalg.norm(np.cross(b - a, d - a), axis=1)
    normals = np.cross(b - a, d - a) / areas[:, None]
    of_face = wanted.normals[::4]
    require(np.allclose(normals, np.stack([of_face[:, 0], -of_face[:, 2], of_face[:, 1]], axis=1), atol=1e-4),
            f"{mesh.name}: faces look elsewhere")
    slots = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    colours = np.array([one.diffuse_color[:3] for one in mesh.materials])[slots]
    light = wanted.colours[::4, :3] / 255.0
    light = np.where(light <= 0.04045, light / 12.92, ((light + 0.055) / 1.055) ** 2.4)
    require(np.allclose(colours, light, atol=1e-5), f"{mesh.name}: faces have other colours")
    require((areas > 0.0099).all() and np.allclose(a + c, b + d, atol=1e-5),
            f"{mesh.name}: faces that are no rectangles")


def check_file(quoin, folder):
    """Groups, layers, lamps, cameras; metal, glass and emissive materials; rotated instances."""
    array = np.zeros((6, 3, 4), np.uint8)
    array[:, 0], array[1, 1, 1], array[4, 1, 2], array[0, 2, 0] = 1, 2, 3, 1
    made = quoin.from_numpy(array, [(1, 1, 1), (2, 2, 2), (3, 3, 3)], "box")
    made.save(os.path.join(folder, "box.json"))
    with open(os.path.join(folder, "box.json")) as file:
        text = file.read()
    grid = text[text.index("[", text.index('"grids"')) + 1 : text.index('"instances"')].rsplit("]", 1)[0]
    path = os.path.join(folder, "all.json")
    with open(path, "w") as file:
        file.write(SCENE_FILE % grid)
    for look in ("TYPES", "PALETTE"):
        empty()
        run(bpy.ops.import_scene.quoin, filepath=path, materials=look, scale=0.5)
        bpy.context.view_layer.update()
        require(bpy.data.objects["first"].users_collection[0].name == "room", "groups are collections")
        require("room" in bpy.data.collections["house"].children, "groups lie within groups")
        require(bpy.data.objects["away"].hide_render and not bpy.data.objects["first"].hide_render, "layers hide")
        camera = bpy.context.scene.camera
        require(camera is not None and np.allclose(camera.matrix_world.translation, (5, -25, 10)), "a camera's place")
        forward = np.array(camera.matrix_world)[:3, :3] @ (0, 0, -1)
        require(np.allclose(forward, (0, 1, 0), atol=1e-6), f"a camera looks along {forward}")
        require(abs(math.degrees(camera.data.angle_y) - 40) < 1e-3, "a camera's angle")
        lamp = bpy.data.objects["torch"]
        require(lamp.data.type == "SPOT" and np.allclose(lamp.matrix_world.translation, (0.5, -1.5, 1)),
                "a lamp's place")
        require(abs(lamp.data.energy - 5 * 4 * math.pi**2 * 0.25) < 1e-3, "a lamp's power")
        # Two instances with quarter turns keep their voxels; the third is voxelized.
        run(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "turned.vox"), scale=0.5, fill="solid")
        again = quoin.load(os.path.join(folder, "turned.vox"))
        require(len(again.instances) == 4, f"{len(again.instances)} instances")
        away = next(one for one in again.instances if one.name == "away")
        require(away.layer == "attic" and away.visible and not away.shown, f"instance in a hidden layer: {away}")
        first = next(one for one in again.instances if one.name == "first")
        require([one.name for one in again.groups] == ["house", "room"] and again.groups[first.group].name == "room",
                f"groups: {again.groups}")
        colours = lambda of: {tuple(row) for row in points_of(of)[:, 3:6]}
        require(colours(again) == colours(quoin.load(path)), f"{look}: colours {colours(again)}")
        run(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "turned.json"), scale=0.5)
        turned = quoin.load(os.path.join(folder, "turned.json"))
        require(len(turned.grids) == 1 and np.array_equal(points_of(turned), points_of(quoin.load(path))),
                "turned.json")
    empty()
    run(bpy.ops.import_scene.quoin, filepath=path, materials="TYPES")
    shader = lambda name: next(n for n in bpy.data.materials[name].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    value = lambda name, old, new=None: (shader(name).inputs.get(old) or shader(name).inputs[new]).default_value
    require(value("gold", "Metallic") == 1 and abs(value("gold", "Roughness") - 0.25) < 1e-6, "gold")
    require(abs(value("glass", "Transmission", "Transmission Weight") - (1 - 90 / 255)) < 1e-6,
            "glass lets light through")
    require(abs(value("glass", "IOR") - 1.33) < 1e-6, "glass refracts")
    require(value("lamp", "Emission Strength") == 8, "a lamp shines")
    require(abs(bpy.data.materials["gold"].diffuse_color[0] - ((250 / 255 + 0.055) / 1.055) ** 2.4) < 1e-5,
            "gold's colour")
    # Export writes edits made in Blender.
    group = next(n for n in bpy.data.materials["gold"].node_tree.nodes if n.type == "GROUP")
    group.inputs[0].default_value = (0, 0, 1, 1)
    run(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "blue.json"))
    blue = [one for one in quoin.load(os.path.join(folder, "blue.json")).types if one.name == "gold"]
    require([tuple(one.rgba) for one in blue] == [(0, 0, 255, 255)] and blue[0].metalness == 1, f"blue gold: {blue}")


def arrangement(quoin, path):
    """Returns a file's groups, layers and visibility by name."""
    scene = quoin.load(path)
    name = lambda number: "" if number is None else scene.groups[number].name
    return {
        "groups": sorted((one.name, name(one.parent), one.shown, one.layer) for one in scene.groups),
        "instances": sorted((one.name, name(one.group), one.visible, one.shown, one.layer) for one in scene.instances),
        "layers": sorted((one.name, one.visible) for one in scene.layers),
    }


def same_cameras(found, wanted):
    require([one.number for one in found] == [one.number for one in wanted], f"cameras {[one.number for one in found]}")
    for a, b in zip(found, wanted):
        for name in ("position", "right", "up", "forward", "fov", "focus_distance"):
            require(np.allclose(getattr(a, name), getattr(b, name), atol=2e-4), f"camera {b.number}: {name} {a} {b}")
        require((a.view_height is None) == (b.view_height is None), f"camera {b.number}: projection")
        require(b.view_height is None or abs(a.view_height - b.view_height) < 1e-4, f"camera {b.number}: height")


def check_round_trip(quoin, folder):
    """Groups, layers, hidden objects, cameras and the sun survive import and export."""
    box = np.ones((3, 4, 5), np.uint8)
    scene = quoin.from_numpy(box, [(200, 30, 30)], "free")
    scene.set_layer("ground")
    scene.set_layer("attic", visible=False)
    house = scene.add_group("house")
    room = scene.add_group("room", house, layer="ground")
    cellar = scene.add_group("cellar", house, visible=False)
    below = scene.add_group("below", cellar)
    upstairs = scene.add_group("upstairs", house, layer="attic")
    loft = scene.add_group("loft", upstairs)
    for number, (name, group, layer, visible) in enumerate([
            ("chair", room, "", True), ("ghost", room, "ground", False), ("barrel", below, "", True),
            ("trunk", loft, "", True), ("bird", None, "attic", True)]):
        matrix = np.eye(4)
        matrix[0, 3] = 10 * (number + 1)
        place = scene.place(scene.grids[0], matrix, name, visible)
        scene.assign(place, group, layer)
    turn = lambda axis, degrees: np.roll(np.roll(np.array(
        [[1, 0, 0], [0, math.cos(math.radians(degrees)), -math.sin(math.radians(degrees))],
         [0, math.sin(math.radians(degrees)), math.cos(math.radians(degrees))]]), axis, 0), axis, 1)
    wanted = []
    for number, (angles, height) in enumerate([((20, 130, 15), None), ((-90, 30, 0), None), ((0, 0, 0), None),
                                               ((-30, 45, 0), 70.0), ((90, 0, 0), None)]):
        axes = turn(1, angles[1]) @ turn(0, angles[0]) @ turn(2, angles[2])
        place = 5.0 + number - 200.0 * -axes[:, 2]
        wanted.append(quoin.Camera(tuple(place), tuple(axes[:, 0]), tuple(axes[:, 1]), tuple(-axes[:, 2]),
                                   45.0 if height else 25.0 + 10 * number, height, 81.0 if height else 30.0, 2 * number))
        if height:  # from the file's radius
            wanted[-1] = wanted[-1]._replace(focus_distance=height / (2 * math.tan(math.radians(22.5))))
        scene.add_camera(wanted[-1])
    scene.set_sun(quoin.Sun((0.3, 0.5, -0.8), 2.0, (1.0, 0.6, 0.3), 4.0))
    before, path = os.path.join(folder, "before.vox"), os.path.join(folder, "after.vox")
    scene.save(before)
    same_cameras(quoin.load(before).cameras, wanted)
    for scale in (0.1, 1.0):
        empty()
        run(bpy.ops.import_scene.quoin, filepath=before, scale=scale)
        bpy.context.view_layer.update()
        require(bpy.data.collections["cellar"].hide_render and not bpy.data.objects["barrel"].hide_render,
                "a hidden group is a hidden collection")
        require(bpy.data.objects["trunk"].hide_render, "objects in a hidden layer are hidden")
        require(bpy.context.scene.camera.name == "before camera", "the first camera is looked through")
        run(bpy.ops.export_scene.quoin, filepath=path, scale=scale)
        a, b = arrangement(quoin, before), arrangement(quoin, path)
        for name in a:
            require(a[name] == b[name], f"{name}: {b[name]} instead of {a[name]}")
        again = quoin.load(path)
        require(np.array_equal(points_of(again), points_of(quoin.load(before))), "voxels")
        same_cameras(again.cameras, wanted)
        sun, first = again.sun_light, quoin.load(before).sun_light
        require(np.allclose(sun.direction, first.direction, atol=1e-5), f"the sun's direction {sun}")
        require(np.allclose([sun.brightness, sun.angle], [2.0, 4.0], atol=1e-4), f"the sun {sun}")
        require(np.allclose(sun.colour, (1.0, 0.6, 0.3), atol=5e-3), f"the sun's colour {sun}")
    # Objects visible in Blender are visible in the file, with their layer.
    bpy.data.objects["bird"].hide_render = bpy.data.objects["bird"].hide_viewport = False
    bpy.data.collections["cellar"].hide_render = bpy.data.collections["cellar"].hide_viewport = False
    run(bpy.ops.export_scene.quoin, filepath=path, scale=1.0)
    shown = {one.name: one.shown for one in quoin.load(path).instances}
    require(shown == {"free": True, "chair": True, "ghost": False, "barrel": True, "trunk": False, "bird": True},
            f"shown: {shown}")
    run(bpy.ops.export_scene.quoin, filepath=path, scale=1.0, hidden=False, lights=False, collections="NONE")
    again = quoin.load(path)
    require({one.name for one in again.instances} == {"free", "chair", "barrel", "bird"}, "without hidden objects")
    require(not again.groups and not again.cameras and again.sun_light is None, "without all else")


def reported(operator, **options):
    """Returns the warnings of an export."""
    from quoin_voxels import exporter
    warnings, write = [], exporter.export_file

    def listen(*arguments):
        made = write(*arguments)
        warnings.extend(made.warnings)
        return made

    exporter.export_file = listen
    try:
        run(operator, **options)
    finally:
        exporter.export_file = write
    return warnings


def check_own_scene(quoin, folder):
    """Exports a scene made in Blender: collections as groups or layers, render cameras, lights by name."""
    empty()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 300, 400
    garden = bpy.data.collections.new("garden")
    trees = bpy.data.collections.new("trees")
    unseen = bpy.data.collections.new("unseen")
    scene.collection.children.link(garden)
    garden.children.link(trees)
    scene.collection.children.link(unseen)
    unseen.hide_render = True
    for collection, place in ((scene.collection, 0), (garden, 2), (trees, 4), (unseen, 6)):
        bpy.ops.mesh.primitive_cube_add(size=1, location=(place, 0, 0.5))
        cube = bpy.context.object
        cube.name = f"cube of {collection.name}"
        for one in list(cube.users_collection):
            one.objects.unlink(cube)
        collection.objects.link(cube)
    for kind in ("POINT", "SPOT", "AREA", "SUN", "SUN"):
        light = bpy.data.lights.new(f"my {kind}", kind)
        light.energy = 1.0 + len(bpy.data.lights)
        scene.collection.objects.link(bpy.data.objects.new(light.name, light))
    for kind, fit in (("PERSP", "AUTO"), ("PERSP", "HORIZONTAL"), ("ORTHO", "AUTO"), ("PANO", "AUTO")):
        data = bpy.data.cameras.new(f"{kind} {fit}")
        data.type, data.sensor_fit, data.lens, data.ortho_scale = kind, fit, 35.0, 8.0
        made = bpy.data.objects.new(data.name, data)
        made.location, made.rotation_euler, made.scale = (4, -9, 3), (1.2, 0.1, 0.3), (2, 2, 2)
        scene.collection.objects.link(made)
        if fit == "HORIZONTAL":
            scene.camera = made
            data.shift_x = 0.1
    bpy.context.view_layer.update()
    path = os.path.join(folder, "own.vox")
    warnings = reported(bpy.ops.export_scene.quoin, filepath=path, fill="solid")
    line = next(one for one in warnings if "leaves out" in one)
    for name in ("point light my POINT", "spot light my SPOT", "area light my AREA", "sun my SUN",
                 "panoramic camera PANO AUTO"):
        require(name in line, f"{name} is not reported: {line}")
    require(line.count("my SUN") == 1, f"one sun stays: {line}")
    require(any("PERSP HORIZONTAL" in one and "shifted" in one for one in warnings), f"the shift is not reported: {warnings}")
    made = quoin.load(path)
    require({one.name for one in made.instances} ==
            {f"cube of {name}" for name in ("garden", "trees", scene.collection.name)}, "what renders show")
    require([(one.name, one.parent) for one in made.groups] == [("garden", None), ("trees", 0)], f"{made.groups}")
    require(abs(made.sun_light.brightness - (1.0 + 5) / math.pi) < 1e-5, f"the stronger sun: {made.sun_light}")
    # 36 mm across 300 pixels are 48 mm across 400.
    high = 2 * math.degrees(math.atan(24 / 35))
    auto = 2 * math.degrees(math.atan(18 / 35))
    fovs = [one.fov for one in made.cameras if one.view_height is None]
    require(np.allclose(fovs, [high, auto], atol=1e-3), f"lenses {fovs}, not {[high, auto]}")
    heights = [one.view_height for one in made.cameras if one.view_height is not None]
    require(np.allclose(heights, [80.0], atol=1e-3), f"heights {heights}")
    for one in made.cameras:
        require(one.view_height is not None or np.allclose(one.position, (40, 30, 90), atol=1e-3), f"a place {one}")
    for ending, lamps in ((".json", 2), (".quoin", 2)):
        warnings = reported(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "own" + ending), fill="solid")
        made = quoin.load(os.path.join(folder, "own" + ending))
        require(len(made.lamps) == lamps, f"{ending}: {len(made.lamps)} lamps")
        require(any("area light my AREA" in one for one in warnings), f"{ending}: {warnings}")
    warnings = reported(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "own.qb"), fill="solid")
    require(any("camera PERSP AUTO" in one and "sun my SUN" in one for one in warnings), f".qb: {warnings}")
    run(bpy.ops.export_scene.quoin, filepath=path, fill="solid", collections="LAYERS")
    made = quoin.load(path)
    require({one.name: one.layer for one in made.instances} == {
        "cube of garden": "garden", "cube of trees": "garden", f"cube of {scene.collection.name}": ""}, "layers")
    require([one.name for one in made.groups] == ["trees"], f"groups in layers: {made.groups}")


def check_voxelized(quoin, folder):
    """Any mesh becomes voxels: places, colours, modifiers, instances."""
    empty()
    bpy.ops.mesh.primitive_cube_add(size=2, location=(5, 0, 1))
    cube = bpy.context.object
    red = bpy.data.materials.new("red")
    red.use_nodes = True
    red.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1, 0, 0, 1)
    cube.data.materials.append(red)
    path = os.path.join(folder, "cube.vox")
    run(bpy.ops.export_scene.quoin, filepath=path, fill="solid")
    scene = quoin.load(path)
    points = points_of(scene)
    require(len(points) == 8000, f"{len(points)} voxels of 20 x 20 x 20")
    require((points[:, :3].min(0) == (40, 0, -10)).all() and (points[:, :3].max(0) == (59, 19, 9)).all(), "their place")
    require((points[:, 3:] == (255, 0, 0, 255)).all(), "their colour")
    cube.modifiers.new("array", "ARRAY").count = 3
    run(bpy.ops.export_scene.quoin, filepath=path, fill="solid")
    require(len(points_of(quoin.load(path))) == 24000, "modifiers count")
    # Imported meshes that were edited are voxelized.
    empty()
    quoin.from_numpy(np.ones((4, 4, 4), np.uint8), [(9, 9, 9)]).save(path)
    run(bpy.ops.import_scene.quoin, filepath=path, lights=False)
    for vertex in next(one for one in bpy.data.objects).data.vertices:
        vertex.co *= 2
    run(bpy.ops.export_scene.quoin, filepath=path, fill="solid")
    require(len(points_of(quoin.load(path))) == 512, "edited meshes are voxelized")


def imported_box(quoin, folder, **options):
    """Two types: a floor of the first under 4 x 4 x 4 voxels of the second."""
    empty()
    path = os.path.join(folder, "two.json")
    array = np.full((4, 5, 4), 2, np.uint8)
    array[:, 0] = 1
    types = [quoin.VoxelType((200, 0, 0), "red"), quoin.VoxelType((0, 0, 200), "blue")]
    quoin.from_numpy(array, types).save(path)
    run(bpy.ops.import_scene.quoin, filepath=path, lights=False, **options)
    return next(one for one in bpy.data.objects if one.type == "MESH")


def check_edits(quoin, folder):
    """Export writes every edit."""
    path = os.path.join(folder, "edited.json")

    def exported(**options):
        run(bpy.ops.export_scene.quoin, filepath=path, fill="solid", **options)
        return quoin.load(path)

    def counts(scene):
        colours, of = np.unique(points_of(scene)[:, 3:6], axis=0, return_counts=True)
        return {tuple(colour): int(count) for colour, count in zip(colours, of)}

    imported_box(quoin, folder)
    require(counts(exported()) == {(200, 0, 0): 16, (0, 0, 200): 64}, "as it was")
    mesh = imported_box(quoin, folder).data
    for face in mesh.polygons:
        face.material_index = 0
    require(set(counts(exported())) == {(200, 0, 0)}, "faces given another material")
    one = imported_box(quoin, folder)
    bpy.context.view_layer.objects.active = one
    bpy.ops.object.mode_set(mode="EDIT")
    import bmesh
    edit = bmesh.from_edit_mesh(one.data)
    for vertex in edit.verts:
        vertex.co *= 2
    bmesh.update_edit_mesh(one.data)
    found = counts(exported())
    require(sum(found.values()) == 640, f"edits in Edit Mode: {found}")
    bpy.ops.object.mode_set(mode="OBJECT")
    one = imported_box(quoin, folder)
    one.shape_key_add(name="Basis")
    key = one.shape_key_add(name="large")
    for point in key.data:
        point.co *= 2
    key.value = 1.0
    found = counts(exported())
    require(sum(found.values()) == 640, f"shape keys: {found}")
    mesh = imported_box(quoin, folder).data
    from quoin_voxels import kept
    before = kept.fingerprint(mesh)
    corners = [mesh.loops[i].vertex_index for i in range(4)]
    mesh.loops[0].vertex_index = corners[1]
    require(kept.fingerprint(mesh) != before, "a face with other corners")

    # Materials that become transparent.
    imported_box(quoin, folder)
    shader = next(n for n in bpy.data.materials["red"].node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Alpha"].default_value = 0.4
    shader.inputs["IOR"].default_value = 1.25
    red = next(one for one in exported().types if one.name == "red")
    require(red.rgba == (200, 0, 0, 102) and red.transparent and abs(red.ior - 1.25) < 1e-6, f"clear red: {red}")
    # Export ignores a palette's images and warns if they were edited.
    one = imported_box(quoin, folder, materials="PALETTE")
    from quoin_voxels import materials
    require(not materials.is_edited_palette(one.data.materials[0]), "the palette as it was")
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "palette.blend"))
    bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "palette.blend"))
    material = next(one for one in bpy.data.objects if one.type == "MESH").data.materials[0]
    require(not materials.is_edited_palette(material), "the palette in the .blend")
    image = next(n.image for n in material.node_tree.nodes if n.type == "TEX_IMAGE" and "colours" in n.image.name)
    image.pixels[4] = 0.1
    require(materials.is_edited_palette(material), "an edited palette")

    # Objects whose rotation or scale the format does not support are voxelized.
    one = imported_box(quoin, folder)
    one.rotation_euler = (0, 0, math.radians(30))
    for ending in (".qb", ".gox", ".vxl", ".binvox", ".schem", ".vox"):
        other = os.path.join(folder, "turned" + ending)
        run(bpy.ops.export_scene.quoin, filepath=other, fill="solid")
        count = len(points_of(quoin.load(other)))
        ground = 512 * 512 if ending == ".vxl" else 0
        require(40 < count < ground + 120, f"{ending}: {count} voxels")
    # Two voxels far apart are not kept.
    far = np.zeros((512, 512, 512), np.uint8)
    far[0, 0, 0] = far[-1, -1, -1] = 1
    scene = quoin.from_numpy(far, [(9, 9, 9)])
    mesh = bpy.data.meshes.new("far")
    require(not kept.keep(mesh, scene.grids[0], scene.types, 0.1, {}, [None] * len(scene.types)), "a box of two voxels")


def check_many_types(quoin, folder):
    """More types than .vox supports: merges similar colours, but not types that differ in more than colour."""
    empty()
    array = np.arange(1, 1001, dtype=np.uint16).reshape(10, 10, 10)
    colours = [((i * 7) % 256, (i * 13) % 256, i // 4) for i in range(999)]
    path = os.path.join(folder, "many.json")
    quoin.from_numpy(array, colours + [quoin.VoxelType((9, 9, 9, 255), "lamp", emission=5.0)]).save(path)
    run(bpy.ops.import_scene.quoin, filepath=path)
    for ending, wanted in ((".vox", 255), (".json", 1000)):
        warnings = reported(bpy.ops.export_scene.quoin, filepath=os.path.join(folder, "fewer" + ending))
        made = quoin.load(os.path.join(folder, "fewer" + ending))
        types = made.grids[0].to_numpy()
        used = np.unique(types)
        require(len(used) == wanted and types.size == 1000, f"{ending}: {len(used)} types")
        require(any("of 1000 types" in one for one in warnings) == (ending == ".vox"), f"{ending}: {warnings}")
        lamp = made.types[int(types[-1, -1, -1])]
        require(lamp.emission == 5.0 and lamp.rgba[:3] == (9, 9, 9), f"{ending}: {lamp}")
        found = made.palette[types][..., :3].reshape(-1, 3)[:999].astype(int)
        off = np.abs(found - np.array(colours)).mean()
        require(off < 16 if ending == ".vox" else off == 0, f"{ending}: colours are off by {off}")


def plane(faces):
    """Creates a square of faces x faces quads at z = 0.05, each with its own texture coordinates."""
    x, y = np.meshgrid(np.arange(faces + 1), np.arange(faces + 1))
    points = np.stack([x.ravel() * 0.1, y.ravel() * 0.1, np.full(x.size, 0.05)], axis=1)
    first = (np.arange(faces)[:, None] * (faces + 1) + np.arange(faces)).ravel()
    mesh = bpy.data.meshes.new("plane")
    quads = np.stack([first, first + 1, first + faces + 2, first + faces + 1], axis=1)
    mesh.from_pydata(points.tolist(), [], quads.tolist())
    layer = mesh.uv_layers.new(name="uv")
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    places = (points[corners, :2] / (0.1 * faces)).astype(np.float32)
    layer.data.foreach_set("uv", places.ravel())
    bpy.context.collection.objects.link(bpy.data.objects.new("plane", mesh))
    return mesh, layer, places


def painted(name, kind):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    shader = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
    node = nodes.new(kind)
    material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material, node


def check_colours(quoin, folder):
    """Textures and colours of vertices."""
    path = os.path.join(folder, "painted.json")
    colours = lambda: {tuple(row) for row in points_of(quoin.load(path))[:, 3:6]}
    for edge in (8, 264):  # the larger square has more colours than there are types
        empty()
        mesh, layer, places = plane(edge)
        material, node = painted("image", "ShaderNodeTexImage")
        node.image = bpy.data.images.new("image", edge, edge)
        node.interpolation = "Closest"
        pixels = np.ones((edge * edge, 4), np.float32)
        number = np.arange(edge * edge)
        pixels[:, 0], pixels[:, 1], pixels[:, 2] = number % 256 / 255, number // 256 % 256 / 255, number // 65536 / 255
        node.image.pixels.foreach_set(pixels.ravel())
        mesh.materials.append(material)
        run(bpy.ops.export_scene.quoin, filepath=path, fill="surface")
        if edge == 8:
            require(colours() == {(i, 0, 0) for i in range(64)}, f"texels: {colours()}")
        else:
            require(len(colours()) > 1000, f"{len(colours())} colours")
    empty()
    mesh, layer, places = plane(8)
    material, node = painted("image", "ShaderNodeTexImage")
    node.image = bpy.data.images.new("image", 4, 4, float_buffer=False)
    mesh.materials.append(material)
    places = np.full_like(places, -1e-9)
    places[4:8] = np.nan
    layer.data.foreach_set("uv", places.ravel())
    run(bpy.ops.export_scene.quoin, filepath=path, fill="surface")
    require(len(points_of(quoin.load(path))) == 64, "places just below 0, and none")

    # Vertex colours apply to only one material.
    empty()
    mesh, layer, places = plane(8)
    layer = mesh.color_attributes.new("Colour", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.tile(np.array([0, 1, 0, 0], np.float32), len(mesh.vertices)))
    material, node = painted("vertices", "ShaderNodeVertexColor")
    node.layer_name = "Colour"
    red = bpy.data.materials.new("red")
    red.use_nodes = True
    shader = next(n for n in red.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (1, 0, 0, 1)
    mesh.materials.append(material)
    mesh.materials.append(red)
    for face in mesh.polygons[32:]:
        face.material_index = 1
    run(bpy.ops.export_scene.quoin, filepath=path, fill="surface")
    require(colours() == {(0, 255, 0), (255, 0, 0)}, f"colours of vertices: {colours()}")


def check_refusals(folder):
    empty()
    refused(bpy.ops.import_scene.quoin, "No such file", filepath=os.path.join(folder, "nothing.vox"))
    bad = os.path.join(folder, "bad.vox")
    with open(bad, "wb") as file:
        file.write(b"VOX \x96\0\0\0MAIN")
    refused(bpy.ops.import_scene.quoin, "bad.vox", filepath=bad)
    refused(bpy.ops.export_scene.quoin, "cannot export: nothing is", filepath=os.path.join(folder, "x.vox"))
    bpy.ops.mesh.primitive_cube_add()
    refused(bpy.ops.export_scene.quoin, "x.unknown", filepath=os.path.join(folder, "x.unknown"))
    refused(bpy.ops.export_scene.quoin, "16384", filepath=os.path.join(folder, "x.vox"), scale=1e-6)
    refused(bpy.ops.export_scene.quoin, "does not exist", filepath=os.path.join(folder, "none", "x.vox"))


def check_surfaces(path):
    """Smooth surfaces, with colours and occlusion, and their own faces."""
    empty()
    run(bpy.ops.import_scene.quoin, filepath=path, surface="SMOOTH", occlusion=0.5)
    mesh = max(bpy.data.meshes, key=lambda one: len(one.polygons))
    require({"Colour", "Occlusion"} <= set(mesh.color_attributes.keys()), "attributes")
    require(all(one.loop_total == 3 for one in mesh.polygons[:50]), "triangles")
    group = next(one for one in bpy.data.node_groups if one.name.startswith("Quoin Occlusion"))
    require(group.nodes["Strength"].outputs[0].default_value == 0.5, "the occlusion's strength")


def check_textures(quoin, folder):
    """Textured faces have materials with images, which repeat per voxel, and an export keeps them."""
    random = np.random.default_rng(3)
    bark, leaf = (random.integers(0, 256, (16, 16, n), np.uint8) for n in (3, 4))
    scene = quoin.from_numpy(np.array([1, 1, 1, 3, 0, 2], np.uint8).reshape(6, 1, 1),
                             [(9, 9, 9), (9, 9, 9, 200), (200, 10, 20)])
    side = quoin.Face(bark, "bark", turn=1, tint=(255, 128, 64))
    scene.set_faces(1, [side] * 4 + [quoin.Face(bark, "bark"), side])
    scene.set_faces(2, quoin.Face(leaf, "leaf", alpha="cutout"))
    path = os.path.join(folder, "textures.json")
    scene.save(path)
    for palette in ("AUTO", "PALETTE"):
        empty()
        run(bpy.ops.import_scene.quoin, filepath=path, scale=1.0, materials=palette)
        mesh, = bpy.data.meshes
        textured = [one for one in mesh.materials if any(node.type == "UVMAP" for node in one.node_tree.nodes)]
        require(len(textured) == 3 and len(mesh.materials) == 4, f"{len(mesh.materials)} materials")
        faces = {}
        for polygon in mesh.polygons:
            material = mesh.materials[polygon.material_index]
            if material not in textured:
                continue
            node = next(one for one in material.node_tree.nodes if one.type == "TEX_IMAGE")
            require(node.interpolation == "Closest" and node.extension == "REPEAT" and node.image.packed_file, "image")
            pixels = np.empty(16 * 16 * 4, np.float32)
            node.image.pixels.foreach_get(pixels)
            pixels = np.rint(255.0 * pixels).reshape(16, 16, 4)
            uv = np.array([mesh.uv_layers["Texture"].data[i].uv for i in polygon.loop_indices])
            at = np.array([mesh.vertices[mesh.loops[i].vertex_index].co for i in polygon.loop_indices])
            if polygon.normal.y > -0.5 or node.image.name.startswith("leaf"):
                faces[node.image.name.split(".")[0]] = material.blend_method
                continue
            # Towards the viewer, Quoin's +Z: each voxel shows the whole texture upright.
            origin, ways = at[0], (at[1:] - at[0])[:, [0, 2]]
            to_uv = np.linalg.lstsq(ways, uv[1:] - uv[0], rcond=None)[0]
            for x in np.arange(0, 3, 1 / 16) + 1 / 32:
                for z in np.arange(0, 1, 1 / 16) + 1 / 32:
                    u, v = ((np.array([x, z]) - origin[[0, 2]]) @ to_uv + uv[0]) % 1.0
                    found = pixels[int(v * 16), int(u * 16), :3]
                    require((found == bark[int((1 - z) * 16), int(x * 16) % 16]).all(), f"the texel at {x}, {z}")
            faces["front"] = True
        require(faces == {"bark": "OPAQUE", "leaf": "CLIP", "front": True}, f"faces {faces}")
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "textures.blend"))
        bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "textures.blend"))
        again = os.path.join(folder, "textures_again.json")
        run(bpy.ops.export_scene.quoin, filepath=again, scale=1.0)
        read = quoin.load(again)
        types = {one.name: i for i, one in enumerate(read.types)}
        kept = [read.textures().faces(i) for i in range(1, len(read.types))]
        wanted = [scene.textures().faces(i) for i in range(1, len(scene.types))]
        require(sum(one is not None for one in kept) == 2 and len(types) > 0, "textured types")
        for six in wanted:
            same = lambda a, b: a[1:6] == b[1:6] and np.array_equal(a.image, b.image)
            require(six is None or any(other is not None and all(map(same, six, other)) for other in kept), "faces")
    # Edited meshes are voxelized with the texels' colours.
    mesh, = bpy.data.meshes
    mesh.vertices[0].co.x += 0.001
    run(bpy.ops.export_scene.quoin, filepath=again, scale=1.0)
    colours = {tuple(one.rgba[:3]) for one in quoin.load(again).types[1:]}
    texels = {tuple(int(v) for v in one) for one in (*bark.reshape(-1, 3), *leaf[..., :3].reshape(-1, 3))}
    require(colours & texels, f"colours {colours}")


def check_shapes(quoin, folder):
    """Shapes and turned cubes are geometry with the right materials, and an export keeps shapes and states."""
    bark, ring = (np.full((16, 16, 3), value, np.uint8) for value in (120, 200))
    stairs = quoin.VoxelType((150, 110, 70), "stairs", state_bits=3, blocks_light=True)
    log = quoin.VoxelType((90, 60, 30), "log", state_bits=2)
    scene = quoin.from_numpy(np.array([1, 2, 0, 3], np.uint8).reshape(4, 1, 1), [stairs, log, (220, 40, 160, 90)])
    scene.set_shapes(1, [quoin.Element(max=(16, 8, 16), looks={"+Y": (10, 200, 30)}),
                         quoin.Element((8, 8, 0), (16, 16, 16), looks={"-X": quoin.Face(ring, "step", turn=1)})])
    wet = scene.textures().shapes(1)._replace(fluid=quoin.Fluid(1, (quoin.Condition(4, 4),)))
    scene.set_shapes(1, wet)
    scene.set_type(1, stairs)  # after the shapes, which else decide the light
    scene.set_orientations(1, "about_y_and_upside_down")
    scene.set_faces(2, [quoin.Face(bark, "bark"), quoin.Face(ring, "ring"), quoin.Face(ring, "ring")])
    scene.set_orientations(2, "along_axes")
    leaf = np.full((16, 16, 4), 90, np.uint8)
    scene.set_faces(3, quoin.Face(leaf, "leaf", alpha="cutout"))
    plate = quoin.Element((0, 0, 8), (16, 16, 8), quoin.Turn(45.0), collides=False)
    scene.set_shapes(3, quoin.Shapes((quoin.ShapePart((plate, plate._replace(turn=quoin.Turn(-45.0)))),)))
    states = np.array([2, 1, 0, 0], np.uint8).reshape(4, 1, 1)
    scene.grids[0].write_states(states)
    path = os.path.join(folder, "shapes.json")
    scene.save(path)
    for palette in ("AUTO", "PALETTE"):
        empty()
        run(bpy.ops.import_scene.quoin, filepath=path, scale=1.0, materials=palette)
        mesh, = bpy.data.meshes
        seen = {}
        for polygon in mesh.polygons:
            name = mesh.materials[polygon.material_index].name.split(".")[0]
            corners = np.array([mesh.vertices[i].co for i in polygon.vertices])
            seen.setdefault(name, []).append((corners.min(0), corners.max(0), np.array(polygon.normal)))
        plain = "shapes palette" if palette == "PALETTE" else "stairs"
        require(set(seen) == {plain, "stairs", "step", "bark", "ring", "leaf"}, f"materials {sorted(seen)}")
        # Blender's z is up. The stairs are turned by a half turn: the high half is at -X and its step looks to +X.
        (low, high, normal), = seen["step"]
        require(np.allclose(low[::2], (0.5, 0.5)) and np.allclose(high[::2], (0.5, 1.0)) and normal[0] > 0.9, "step")
        green = [one for one in mesh.materials if one.name.startswith("stairs")
                 and np.allclose(one.diffuse_color[:3], (0.003, 0.578, 0.013), atol=1e-3)]
        require(len(green) == 1, "the slab's own colour")
        require(all(abs(normal[0]) > 0.9 for _, _, normal in seen["ring"]) and len(seen["ring"]) == 2, "the log lies")
        require(len(seen["bark"]) == 4 and len(seen["leaf"]) == 4, "bark and leaves")
        require(any(abs(abs(normal[0]) - 0.5 ** 0.5) < 1e-3 for _, _, normal in seen["leaf"]), "turned plates")
        depths = [float((low + high) @ normal) for low, high, normal in seen["leaf"] if normal[0] * normal[1] > 0.0]
        require(len(depths) == 2 and 0.001 < sum(depths) < 0.003, f"the sides of a plate lie in one plane: {depths}")
        one_sided = [one.name for one in mesh.materials
                     if any(node.type == "NEW_GEOMETRY" for node in one.node_tree.nodes)]
        require(len(one_sided) == 1 and one_sided[0].startswith("leaf"), f"one-sided: {one_sided}")
        layer = mesh.uv_layers["Texture"].data
        for polygon in mesh.polygons:
            if mesh.materials[polygon.material_index].name.startswith("leaf"):
                uv = np.array([layer[i].uv for i in polygon.loop_indices])
                require(np.allclose(uv.max(0) - uv.min(0), 1.0), "a plate shows the whole texture")
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "shapes.blend"))
        bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "shapes.blend"))
        again = os.path.join(folder, "shapes_again.json")
        run(bpy.ops.export_scene.quoin, filepath=again, scale=1.0)
        read = quoin.load(again)
        require((read.grids[0].to_numpy() == scene.grids[0].to_numpy()).all(), "types")
        require((read.grids[0].states()[:, 0, 0] == states[:, 0, 0]).all(), "states")
        require(read.types[1:] == scene.types[1:], f"types {read.types} {scene.types}")
        for i in range(1, 4):
            require(read.orientations(i) == scene.orientations(i), "orientations")
            a, b = read.textures().shapes(i), scene.textures().shapes(i)
            require((a is None) == (b is None), "shapes")
            bare = lambda shapes: [[each._replace(looks={}) for each in part.elements] for part in shapes.parts]
            require(a is None or bare(a) == bare(b), "elements")
            require(a is None or a.fluid == b.fluid, "contained fluid")
        require(read.textures().shapes(1).fluid == wet.fluid, "the stairs' water")
        step = read.textures().shapes(1).parts[0].elements[1].looks["-X"]
        require((step.name, step.turn) == ("step", 1) and (step.image[..., :3] == ring).all(), "the step's look")
        require(read.textures().shapes(1).parts[0].elements[0].looks["+Y"] == (10, 200, 30), "the slab's colour")


def check_packs(quoin, folder):
    """Resource packs give imported blocks their shapes and textures, and an export keeps them."""
    faces = {side: {"texture": "#all"} for side in ("down", "up", "north", "south", "west", "east")}
    for name, height in (("half", 8), ("quarter", 4)):
        model = {"elements": [{"from": [0, 0, 0], "to": [16, height, 16], "faces": faces}]}
        for path, content in (("blockstates", {"variants": {"": {"model": "block/stone"}}}), ("models/block", model)):
            where = os.path.join(folder, name, "assets", "minecraft", *path.split("/"))
            os.makedirs(where, exist_ok=True)
            with open(os.path.join(where, "stone.json"), "w") as file:
                json.dump(content, file)
    scene = quoin.Scene()
    scene.add_type(quoin.VoxelType((120, 120, 120), "minecraft:stone"))
    scene.add(np.ones((1, 1, 1), np.uint8))
    house = os.path.join(folder, "house.schem")
    scene.save(house)
    half, quarter = os.path.join(folder, "half"), os.path.join(folder, "quarter")
    for packs, height, images in (("", 1.0, 0), (half, 0.5, 0), (f"{half}; {quarter};", 0.25, 0), ("builtin", 1.0, 1)):
        empty()
        run(bpy.ops.import_scene.quoin, filepath=house, scale=1.0, packs=packs)
        mesh = next(one.data for one in bpy.data.objects if one.type == "MESH")
        top = max(one.co.z for one in mesh.vertices)
        require(abs(top - height) < 1e-3, f"packs {packs!r}: the stone is {top} high, not {height}")
        used = {node.image for material in mesh.materials for node in material.node_tree.nodes
                if node.type == "TEX_IMAGE"}
        require((len(used) > 0) == (images > 0), f"packs {packs!r}: {len(used)} images")
    path = os.path.join(folder, "house.json")
    run(bpy.ops.export_scene.quoin, filepath=path, scale=1.0)
    again = quoin.load(path)
    require(any(again.textures().faces(i) for i in range(len(again.types))), "the export has no textures")
    refused(bpy.ops.import_scene.quoin, "absent.zip", filepath=house, packs=os.path.join(folder, "absent.zip"))


def main():
    addon, castle, folder = sys.argv[sys.argv.index("--") + 1 :]
    bpy.ops.preferences.addon_install(filepath=addon)
    bpy.ops.preferences.addon_enable(module="quoin_voxels")
    import quoin_voxels

    scripts = os.environ["BLENDER_USER_SCRIPTS"]
    require(quoin_voxels.__file__.startswith(scripts), f"installed in {quoin_voxels.__file__}")
    require(quoin_voxels.quoin.__file__.startswith(scripts), "with its own package")
    menus = (bpy.types.TOPBAR_MT_file_import, bpy.types.TOPBAR_MT_file_export)
    require(all(any("quoin_voxels" in one.__module__ for one in menu._dyn_ui_initialize()) for menu in menus), "menus")
    # Installed over itself while its library is loaded, as an update does.
    before = quoin_voxels.quoin
    kept = before.load(castle)
    for stays in range(2):
        with open(os.path.join(os.path.dirname(quoin_voxels.__file__), "stale.py"), "w") as file:
            file.write("")
        os.utime(quoin_voxels.__file__, (1e9, 1e9 + stays))
        bpy.ops.preferences.addon_install(filepath=addon)
        bpy.ops.preferences.addon_enable(module="quoin_voxels")
        require(not os.path.exists(os.path.join(os.path.dirname(quoin_voxels.__file__), "stale.py")), "old files go")
    require(quoin_voxels.quoin is not before and len(quoin_voxels.quoin.load(castle).grids) == len(kept.grids),
            "the new library is loaded, and the old one still works")
    quoin = quoin_voxels.quoin
    check_castle(quoin, castle, folder)
    check_file(quoin, folder)
    check_round_trip(quoin, folder)
    check_own_scene(quoin, folder)
    check_many_types(quoin, folder)
    check_voxelized(quoin, folder)
    check_edits(quoin, folder)
    check_colours(quoin, folder)
    check_textures(quoin, folder)
    check_shapes(quoin, folder)
    check_packs(quoin, folder)
    check_refusals(folder)
    check_surfaces(castle)
    empty()
    bpy.ops.preferences.addon_disable(module="quoin_voxels")
    require(not hasattr(bpy.types, "IMPORT_SCENE_OT_quoin"), "it goes without a trace")
    print("the add-on: all right")


try:
    main()
except Exception:
    traceback.print_exc()
    sys.stdout.flush()
    os._exit(1)
