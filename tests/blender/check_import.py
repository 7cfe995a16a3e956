"""Imports GLB files into Blender and compares the result with the files.

Run: blender -b --factory-startup -P check_import.py -- FILE.glb...

Checks every node's name, transform and mesh (vertices in the world, one by one), every material's name and palette
colours, and the occlusion colours. Exit status: 0 all right, 1 not.
"""

import json
import struct
import sys
import traceback
import zlib

import numpy

# Blender 3.4's importer uses a name that newer numpy lacks.
if "bool" not in vars(numpy):
    numpy.bool = bool

import bpy
from mathutils import Matrix, Quaternion, Vector

FORMATS = {5121: ("B", 1), 5123: ("H", 2), 5125: ("I", 4), 5126: ("f", 4)}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# glTF's +Y is Blender's +Z: (x, y, z) becomes (x, -z, y).
BLENDER_FROM_GLTF = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


class Glb:
    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        json_bytes = struct.unpack_from("<I", data, 12)[0]
        self.json = json.loads(data[20 : 20 + json_bytes])
        self.binary = data[28 + json_bytes :]
        nodes = enumerate(self.json.get("nodes", []))
        self.above = {child: i for i, node in nodes for child in node.get("children", [])}

    def accessor(self, index):
        accessor = self.json["accessors"][index]
        letter, _ = FORMATS[accessor["componentType"]]
        width = WIDTHS[accessor["type"]]
        offset = self.json["bufferViews"][accessor["bufferView"]]["byteOffset"]
        count = accessor["count"] * width
        kind = "<" + {"B": "u1", "H": "u2", "I": "u4", "f": "f4"}[letter]
        return numpy.frombuffer(self.binary, kind, count, offset).reshape(-1, width)

    def world(self, number):
        """Returns a node's transform, including its ancestors'."""
        matrix = self.matrix(self.json["nodes"][number])
        above = self.above.get(number)
        return matrix if above is None else self.world(above) @ matrix

    def matrix(self, node):
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        return Matrix.LocRotScale(
            Vector(node.get("translation", (0, 0, 0))), Quaternion((w, x, y, z)), Vector(node.get("scale", (1, 1, 1)))
        )


def require(condition, message):
    if not condition:
        raise AssertionError(message)


def rounded(points):
    return sorted(tuple(round(float(c), 2) + 0.0 for c in p) for p in points)


def expected_triangles(glb, number):
    """Returns all triangle corners in Blender's world space."""
    node = glb.json["nodes"][number]
    matrix = BLENDER_FROM_GLTF @ glb.world(number)
    points = []
    for primitive in glb.json["meshes"][node["mesh"]]["primitives"]:
        positions = glb.accessor(primitive["attributes"]["POSITION"])
        points += [matrix @ Vector(positions[i].tolist()) for i in glb.accessor(primitive["indices"])[:, 0]]
    return points


def imported_triangles(imported):
    mesh = imported.data
    mesh.calc_loop_triangles()
    return [imported.matrix_world @ mesh.vertices[v].co for t in mesh.loop_triangles for v in t.vertices]


def check_outward(glb, node, imported):
    """Blender's face normals, computed from the winding, agree with the file's."""
    mesh = imported.data
    expected = set()
    for primitive in glb.json["meshes"][node["mesh"]]["primitives"]:
        for normal in numpy.unique(glb.accessor(primitive["attributes"]["NORMAL"]), axis=0):
            expected.add(tuple(round(float(c)) for c in (normal[0], -normal[2], normal[1])))
    found = {tuple(round(c) for c in polygon.normal) for polygon in mesh.polygons}
    require(found == expected, f"{imported.name}: normals {found} instead of {expected}")
    count, loops = len(mesh.loops), numpy.empty(len(mesh.loops) * 3, "f4")
    mesh.calc_normals_split()
    mesh.loops.foreach_get("normal", loops)
    loops = loops.reshape(count, 3)
    for polygon in mesh.polygons:
        for loop in polygon.loop_indices:
            require(polygon.normal.dot(Vector(loops[loop].tolist())) > 0.99, f"{imported.name}: inside out")


def check_texels(glb, node, imported):
    """Every triangle has the file's material and texel."""
    mesh = imported.data
    layer = mesh.uv_layers.active.data
    counts = {}
    for polygon in mesh.polygons:
        material = mesh.materials[polygon.material_index]
        key = (material.name, tuple(round(c, 4) for c in layer[polygon.loop_indices[0]].uv))
        counts[key] = counts.get(key, 0) + 1
    names = {m["name"] for m in glb.json["materials"]}
    require(all(name.split(".")[0] in names for name, _ in counts), f"materials {counts.keys()}")
    expected = {}
    for primitive in glb.json["meshes"][node["mesh"]]["primitives"]:
        uv = glb.accessor(primitive["attributes"]["TEXCOORD_0"])
        name = glb.json["materials"][primitive["material"]]["name"]
        for corner in glb.accessor(primitive["indices"])[::3, 0]:
            key = (name, (round(float(uv[corner][0]), 4), round(1 - float(uv[corner][1]), 4)))
            expected[key] = expected.get(key, 0) + 1
    merged = {}
    for (name, texel), count in counts.items():
        key = (name.split(".")[0], texel)
        merged[key] = merged.get(key, 0) + count
    require(merged == expected, f"{imported.name}: texels differ")


def check_occlusion(glb, node, imported):
    primitives = glb.json["meshes"][node["mesh"]]["primitives"]
    has_colours = any("COLOR_0" in primitive["attributes"] for primitive in primitives)
    attributes = imported.data.color_attributes
    require((len(attributes) > 0) == has_colours, f"{imported.name}: {len(attributes)} colour attributes")
    if not has_colours:
        return
    expected = set()
    # Blender keeps colours as sRGB bytes, which costs the mid greys up to one step.
    for primitive in primitives:
        colours = primitive["attributes"].get("COLOR_0")
        # Meshes with occlusion in a texture are white, next to others with occlusion in vertices.
        expected |= {255} if colours is None else {int(c) for c in numpy.unique(glb.accessor(colours)[:, 0])}
    values = numpy.empty(len(attributes[0].data) * 4, "f4")
    attributes[0].data.foreach_get("color", values)
    found = {round(float(v) * 255) for v in numpy.unique(values.reshape(-1, 4)[:, 0])}
    alike = len(found) == len(expected) and all(abs(a - b) <= 1 for a, b in zip(sorted(found), sorted(expected)))
    require(alike, f"{imported.name}: occlusion {found} instead of {expected}")


def decoded_png(data):
    """Reads 8-bit RGB or RGBA without row filters, as Quoin writes it: bytes by row and column."""
    width, height, _, kind = struct.unpack_from(">IIBB", data, 16)
    packed, at = b"", 8
    while at < len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        packed += data[at + 8 : at + 8 + size] if name == b"IDAT" else b""
        at += size + 12
    rows = numpy.frombuffer(zlib.decompress(packed), "u1").reshape(height, -1)
    require(not rows[:, 0].any(), "the PNG has row filters")
    return rows[:, 1:].reshape(height, width, 4 if kind == 6 else 3)


def check_images(glb):
    for image in glb.json.get("images", []):
        found = [i for i in bpy.data.images if i.name.split(".")[0] == image["name"]]
        require(len(found) == 1, f"image {image['name']}: {len(found)} found")
        view = glb.json["bufferViews"][image["bufferView"]]
        expected = decoded_png(glb.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        height, width, channels = expected.shape
        require(tuple(found[0].size) == (width, height), f"image {image['name']} is {tuple(found[0].size)}")
        pixels = numpy.array(found[0].pixels[:], "f4").reshape(height, width, 4)[::-1, :, :channels]
        solid = expected[:, :, -1] > 0 if channels == 4 else numpy.ones((height, width), bool)
        worst = numpy.abs(pixels * 255 - expected)[solid].max(initial=0)
        require(worst < 0.6, f"image {image['name']} is off by {worst}")


def check(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path, merge_vertices=False)
    glb = Glb(path)
    nodes = glb.json.get("nodes", [])
    objects = list(bpy.data.objects)
    require(len(objects) == len(nodes), f"{len(objects)} objects for {len(nodes)} nodes")
    remaining = list(objects)
    for number, node in enumerate(nodes):
        matrix = BLENDER_FROM_GLTF @ glb.world(number) @ BLENDER_FROM_GLTF.inverted()
        distance = lambda o: max(abs(a - b) for r, s in zip(o.matrix_world, matrix) for a, b in zip(r, s))
        named = [o for o in remaining
                 if not node.get("name") or o.name.rsplit(".", 1)[0] == node["name"] or o.name == node["name"]]
        require(named, f"no object called {node.get('name')}")
        imported = min(named, key=distance)
        require(distance(imported) < 1e-3, f"{imported.name}: its transform is off by {distance(imported)}")
        remaining.remove(imported)
        if "mesh" not in node:
            continue
        require(rounded(imported_triangles(imported)) == rounded(expected_triangles(glb, number)),
                f"{imported.name}: triangles differ")
        check_outward(glb, node, imported)
        check_texels(glb, node, imported)
        check_occlusion(glb, node, imported)
    shared = {o.data.name for o in objects if o.type == "MESH"}
    require(len(shared) == len(glb.json.get("meshes", [])), f"{len(shared)} meshes in Blender")
    check_images(glb)
    print(f"ok {path}: {len(nodes)} nodes, {len(shared)} meshes, {len(glb.json.get('materials', []))} materials")


def main():
    paths = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    failed = not paths
    for path in paths:
        try:
            check(path)
        except Exception:
            failed = True
            print(f"FAILED {path}")
            traceback.print_exc()
    sys.stdout.flush()
    sys.exit(1 if failed else 0)


main()
