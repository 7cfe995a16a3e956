"""Builds the box of `quoin_demo_gallery cornell` in Blender, renders it with Cycles and compares with Quoin's image.

Run: blender -b --factory-startup -P check_light.py -- QUOIN.exr SIZE SAMPLES [CYCLES.exr]

QUOIN.exr: `quoin render cornell.vox --light path --sky uniform --sky-brightness 0 --sun off --bounces 8
--camera 16,16,78 --look-at 16,16,16 --fov 38`, square, of linear light.
Compares the mean light of the image within 1 %, and the mean of each of 8 x 8 blocks within 4 %, which includes Cycles'
own noise. Exit status: 0 all right, 1 not.
"""

import math
import struct
import sys
import zlib

import numpy

# Blender 3.4 uses a name that newer numpy lacks.
if "bool" not in vars(numpy):
    numpy.bool = bool

import bpy
from mathutils import Vector

BOUNCES = 8  # scatterings on the way; Cycles counts those after the first
WHITE, RED, GREEN = (222, 222, 222), (200, 40, 36), (60, 160, 60)
EMISSION = 12.0
BLOCKS = 8


def linear(byte):
    value = byte / 255.0
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def material(name, colour, emission=0.0):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    shader = nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Roughness"].default_value = 0.0
    shader.inputs["Color"].default_value = (*[linear(byte) for byte in colour], 1.0)
    if emission > 0.0:  # other lights also light it
        matte, glow, shader = shader, nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
        glow.inputs["Color"].default_value = matte.inputs["Color"].default_value
        glow.inputs["Strength"].default_value = emission
        made.node_tree.links.new(matte.outputs[0], shader.inputs[0])
        made.node_tree.links.new(glow.outputs[0], shader.inputs[1])
    made.node_tree.links.new(shader.outputs[0], out.inputs["Surface"])
    return made


def box(low, high, of):
    """Adds a box given in Quoin's axes: +y is up there, +z in Blender."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = [(x, -z, y) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new("box")
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(of)
    bpy.context.collection.objects.link(bpy.data.objects.new("box", mesh))


def build():
    for each in list(bpy.data.objects):
        bpy.data.objects.remove(each)
    white, red, green = material("white", WHITE), material("red", RED), material("green", GREEN)
    lamp = material("lamp", (255, 255, 255), EMISSION)
    box((-1, -1, -1), (0, 33, 32), red)
    box((32, -1, -1), (33, 33, 32), green)
    box((0, -1, -1), (32, 0, 32), white)
    box((0, 0, -1), (32, 33, 0), white)
    box((0, 32, 0), (12, 33, 32), white)  # the ceiling, around the lamp
    box((20, 32, 0), (32, 33, 32), white)
    box((12, 32, 0), (20, 33, 12), white)
    box((12, 32, 20), (20, 33, 32), white)
    box((12, 32, 12), (20, 33, 20), lamp)
    box((5, 0, 5), (14, 19, 14), white)
    box((18, 0, 16), (28, 9, 26), white)


def look(size, samples):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle_y = math.radians(38.0)
    camera = bpy.data.objects.new("camera", data)
    bpy.context.collection.objects.link(camera)
    camera.location = (16, -78, 16)
    camera.rotation_euler = (Vector((16, -16, 16)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene = bpy.context.scene
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.filter_size = 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0.0, 0.0, 0.0)
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES - 1
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.seed = 1
    return scene


def read(path, size):
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Linear"
    if tuple(image.size) != (size, size):
        raise SystemExit(f"{path}: {tuple(image.size)} instead of {size} x {size}")
    values = numpy.empty(size * size * 4, numpy.float32)
    image.pixels.foreach_get(values)
    return values.reshape(size, size, 4)[::-1, :, :3].astype(numpy.float64)


def read_quoin(path, size):
    """Reads OpenEXR scan lines in blocks of 16, compressed by zlib. Blender gives scripts no pixels of layered files."""
    with open(path, "rb") as file:
        data = file.read()
    at, channels, compression = 8, [], None
    while data[at] != 0:
        name, kind = (data[at:].split(b"\0", 2)[i] for i in (0, 1))
        at += len(name) + len(kind) + 2
        length = struct.unpack_from("<i", data, at)[0]
        value, at = data[at + 4 : at + 4 + length], at + 4 + length
        if name == b"compression":
            compression = value[0]
        while name == b"channels" and len(value) > 1:
            channel, value = value.split(b"\0", 1)
            channels.append((channel.decode(), struct.unpack_from("<i", value)[0]))
            value = value[16:]
    if compression != 3:
        raise SystemExit(f"{path}: not compressed by zlib in blocks")
    kinds = {0: "<u4", 1: "<f2", 2: "<f4"}
    offsets = struct.unpack_from(f"<{(size + 15) // 16}Q", data, at + 1)
    image = numpy.empty((size, size, 3))
    for offset in offsets:
        row, length = struct.unpack_from("<ii", data, offset)
        rows = min(16, size - row)
        whole = rows * size * sum(numpy.dtype(kinds[kind]).itemsize for _, kind in channels)
        packed = data[offset + 8 : offset + 8 + length]
        if length < whole:
            steps = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).astype(numpy.int64)
            steps[1:] -= 128
            plain = (numpy.cumsum(steps) & 255).astype(numpy.uint8)
            half = (whole + 1) // 2
            merged = numpy.empty(whole, numpy.uint8)
            merged[0::2], merged[1::2] = plain[:half], plain[half:]
            packed = merged.tobytes()
        place = 0
        for line in range(row, row + rows):
            for name, kind in channels:
                values = numpy.frombuffer(packed, kinds[kind], size, place)
                place += values.nbytes
                if name in "RGB":
                    image[line, :, "RGB".index(name)] = values
    return image


def blocks(image):
    edge = image.shape[0] // BLOCKS
    return image.reshape(BLOCKS, edge, BLOCKS, edge, 3).mean(axis=(1, 3))


def main():
    words = sys.argv[sys.argv.index("--") + 1 :]
    size, samples = int(words[1]), int(words[2])
    own = words[3] if len(words) > 3 else words[0] + ".cycles.exr"
    build()
    scene = look(size, samples)
    scene.render.filepath = own
    bpy.ops.render.render(write_still=True)
    ours, theirs = read_quoin(words[0], size), read(own, size)
    whole = ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1))
    by_block = blocks(ours) / blocks(theirs)
    print("Quoin / Cycles, red, green, blue:", *(f"{each:.4f}" for each in whole))
    print(f"blocks: {by_block.min():.4f} to {by_block.max():.4f}, root mean square of the difference "
          f"{numpy.sqrt(((by_block - 1.0) ** 2).mean()):.4f}")
    if abs(whole - 1.0).max() > 0.01:
        raise SystemExit("the light differs by more than 1 %")
    if abs(by_block - 1.0).max() > 0.04:
        raise SystemExit("the light of a block differs by more than 4 %")


main()
