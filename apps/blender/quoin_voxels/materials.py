"""Converts voxel types to materials, and materials to voxel types."""

import zlib

import bpy
import numpy as np

from . import quoin, versions

OCCLUSION = "Occlusion"  # the light that reaches a vertex; 1: open
COLOUR = "Colour"
TEXTURE = "Texture"  # the coordinates of textured faces
MOST_MATERIALS = 256
_PALETTE, _MADE = "quoin_palette", "quoin_made"


def linear(srgb):
    """Converts sRGB bytes to linear light."""
    x = np.asarray(srgb, np.float64) / 255.0
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def opaque(srgb):
    """Converts sRGB bytes (n, 3) to linear light with alpha 1, float32 (n, 4)."""
    out = np.ones((len(srgb), 4), np.float32)
    out[:, :3] = linear(srgb)
    return out


def srgb(light):
    """Converts linear light to sRGB bytes."""
    x = np.clip(np.asarray(light, np.float64), 0.0, 1.0)
    return np.rint(255.0 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(int)


def occlusion_group(strength):
    """Creates the node group that darkens a colour by the attribute. Its node Strength applies to all materials."""
    tree = bpy.data.node_groups.new("Quoin Occlusion", "ShaderNodeTree")
    versions.group_socket(tree, "Color", "NodeSocketColor", True)
    versions.group_socket(tree, "Color", "NodeSocketColor", False)
    given, out = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = OCCLUSION
    amount = tree.nodes.new("ShaderNodeValue")
    amount.name = amount.label = "Strength"
    amount.outputs[0].default_value = strength

    def math(operation, a, b):
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, (a, b)):
            if isinstance(value, float):
                socket.default_value = value
            else:
                tree.links.new(value, socket)
        return node.outputs[0]

    # 1 - strength * (1 - open)
    left = math("SUBTRACT", 1.0, math("MULTIPLY", amount.outputs[0], math("SUBTRACT", 1.0, attribute.outputs["Fac"])))
    scaled = tree.nodes.new("ShaderNodeVectorMath")
    scaled.operation = "SCALE"
    tree.links.new(given.outputs[0], scaled.inputs[0])
    tree.links.new(left, scaled.inputs["Scale"])
    tree.links.new(scaled.outputs[0], out.inputs[0])
    for place, node in enumerate(tree.nodes):
        node.location = (180 * place - 700, 0)
    return tree


def _new(name, group):
    """Creates a material whose colour passes through the occlusion group. Returns it, its shader and the group node."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    occlusion = nodes.new("ShaderNodeGroup")
    occlusion.node_tree = group
    occlusion.location = (shader.location.x - 250, shader.location.y)
    material.node_tree.links.new(occlusion.outputs[0], shader.inputs["Base Color"])
    return material, shader, occlusion


def _scatter(material, one, scale):
    # A cloud: no surface, only volume scattering.
    nodes = material.node_tree.nodes
    volume = nodes.new("ShaderNodeVolumeScatter")
    volume.inputs["Color"].default_value = (*linear(one.rgba[:3]), 1.0)
    volume.inputs["Density"].default_value = one.scattering / scale
    volume.inputs["Anisotropy"].default_value = one.anisotropy
    out = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    for link in list(out.inputs["Surface"].links):
        material.node_tree.links.remove(link)
    material.node_tree.links.new(volume.outputs[0], out.inputs["Volume"])


def _set_surface(material, shader, one):
    material.metallic, material.roughness = one.metalness, one.roughness
    shader.inputs["Metallic"].default_value = one.metalness
    shader.inputs["Roughness"].default_value = one.roughness


def of_type(one, number, group, scale):
    """Creates the material of a type."""
    material, shader, occlusion = _new(one.name or f"voxel {number}", group)
    colour = linear(one.rgba[:3])
    occlusion.inputs[0].default_value = (*colour, 1.0)
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    _set_surface(material, shader, one)
    if one.emission > 0.0:
        versions.input_of(shader, "Emission").default_value = (*colour, 1.0)
        shader.inputs["Emission Strength"].default_value = one.emission
    alpha = 1.0
    if one.transparent:
        alpha = one.rgba[3] / 255.0
        versions.input_of(shader, "Transmission").default_value = 1.0 - alpha
        shader.inputs["IOR"].default_value = one.ior
        if hasattr(material, "use_screen_refraction"):
            material.use_screen_refraction = True
    if one.scattering > 0.0:
        _scatter(material, one, scale)
    material.diffuse_color = (*colour, max(alpha, 0.2))  # the colour in the solid viewport
    return material


def _packed(name, values, is_colour):
    height, width = values.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=not is_colour, is_data=not is_colour)
    image.pixels.foreach_set(np.ascontiguousarray(values, np.float32).ravel())
    image.update()
    image.pack()
    return image


def _image(name, values, is_colour):
    image = _packed(name, values, is_colour)
    image[_MADE] = zlib.compress(_pixels(image).tobytes())
    return image


def texture_image(face):
    """Creates the image of a face's texture, multiplied by its tint."""
    texels = face.image.astype(np.float32) / 255.0
    if tuple(face.tint) != (255, 255, 255):
        texels[..., :3] = srgb(linear(face.image[..., :3]) * linear(face.tint)) / 255.0
    image = _packed(face.name or "texture", texels[::-1], True)  # rows from the bottom
    image.alpha_mode = "CHANNEL_PACKED"
    return image


def of_face(one, face, image, group, is_one_sided=False):
    """Creates the material of textured faces of a type, with the image of `texture_image`. `is_one_sided`: the face is
    invisible from behind, where another face of the same place shows its own texels."""
    material, shader, occlusion = _new(face.name or one.name or "texture", group)
    _set_surface(material, shader, one)
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    texture.location = (shader.location.x - 600, shader.location.y)
    coordinates = tree.nodes.new("ShaderNodeUVMap")
    coordinates.uv_map = TEXTURE
    coordinates.location = (shader.location.x - 850, shader.location.y)
    tree.nodes.active = texture
    tree.links.new(coordinates.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], occlusion.inputs[0])
    if one.emission > 0.0:
        tree.links.new(texture.outputs["Color"], versions.input_of(shader, "Emission"))
        shader.inputs["Emission Strength"].default_value = one.emission
    if face.alpha != "opaque":
        alpha = texture.outputs["Alpha"]
        if face.alpha == "cutout":  # a texel is visible from 128 of 255 on
            limit = tree.nodes.new("ShaderNodeMath")
            limit.operation = "GREATER_THAN"
            limit.inputs[1].default_value = 0.5
            limit.location = (shader.location.x - 250, shader.location.y - 250)
            tree.links.new(alpha, limit.inputs[0])
            alpha = limit.outputs[0]
        if is_one_sided:
            geometry = tree.nodes.new("ShaderNodeNewGeometry")
            geometry.location = (shader.location.x - 450, shader.location.y - 450)
            front = tree.nodes.new("ShaderNodeMath")
            front.operation = "SUBTRACT"
            front.inputs[0].default_value = 1.0
            front.location = (shader.location.x - 250, shader.location.y - 450)
            tree.links.new(geometry.outputs["Backfacing"], front.inputs[1])
            both = tree.nodes.new("ShaderNodeMath")
            both.operation = "MULTIPLY"
            both.location = (shader.location.x - 100, shader.location.y - 350)
            tree.links.new(alpha, both.inputs[0])
            tree.links.new(front.outputs[0], both.inputs[1])
            alpha = both.outputs[0]
        tree.links.new(alpha, shader.inputs["Alpha"])
        if hasattr(material, "blend_method"):
            material.blend_method = "CLIP" if face.alpha == "cutout" else "BLEND"
    mean = linear(face.image[..., :3]).reshape(-1, 3).mean(0) * linear(face.tint)
    material.diffuse_color = (*mean, 1.0)
    return material


class Palette:
    """One material for all opaque types, with colours and surface properties in two images."""

    def __init__(self, name, types, group):
        rows = (len(types) + 255) // 256
        colours = np.zeros((rows * 256, 4), np.float32)
        surfaces = np.zeros((rows * 256, 4), np.float32)
        colours[:len(types)] = np.array([one.rgba for one in types], np.float32) / 255.0
        colours[:, 3] = 1.0
        surfaces[:len(types)] = [(one.emission, one.roughness, one.metalness, 1.0) for one in types]
        self.rows = rows
        self.material, shader, occlusion = _new(f"{name} palette", group)
        tree = self.material.node_tree

        def texture(label, values, is_colour, y):
            node = tree.nodes.new("ShaderNodeTexImage")
            node.image = _image(f"{name} {label}", values.reshape(rows, 256, 4), is_colour)
            node.interpolation = "Closest"
            node.location = (shader.location.x - 750, y)
            return node

        self.material[_PALETTE] = 2  # images
        surface = texture("surfaces", surfaces, False, 0)
        colour = texture("colours", colours, True, 300)
        tree.nodes.active = colour
        separate = tree.nodes.new("ShaderNodeSeparateColor")
        separate.location = (shader.location.x - 450, 0)
        tree.links.new(surface.outputs["Color"], separate.inputs[0])
        tree.links.new(colour.outputs["Color"], occlusion.inputs[0])
        tree.links.new(colour.outputs["Color"], versions.input_of(shader, "Emission"))
        tree.links.new(separate.outputs[0], shader.inputs["Emission Strength"])
        tree.links.new(separate.outputs[1], shader.inputs["Roughness"])
        tree.links.new(separate.outputs[2], shader.inputs["Metallic"])
        self.material.diffuse_color = (*linear(np.array([one.rgba[:3] for one in types[1:]] or [[0] * 3])).mean(0), 1.0)

    def places(self, types):
        """Returns the texture coordinates of types, float32 (n, 2)."""
        return np.stack([(types % 256 + 0.5) / 256.0, (types // 256 + 0.5) / self.rows], axis=1).astype(np.float32)


def _pixels(image):
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return values


def is_edited_palette(material):
    """Returns true if a palette's images were edited or removed."""
    if material.get(_PALETTE) is None:
        return False
    images = [node.image for node in material.node_tree.nodes if node.type == "TEX_IMAGE" and node.image]
    made = [one for one in images if one.get(_MADE) is not None]
    if len(made) < material[_PALETTE]:
        return True
    for image in made:
        wanted, found = np.frombuffer(zlib.decompress(image[_MADE]), np.float32), _pixels(image)
        # A .blend stores pixels with less precision.
        if wanted.shape != found.shape or not np.allclose(found, wanted, rtol=4e-3, atol=2e-3):
            return True
    return False


def smooth(name, group):
    """Creates the material of smooth surfaces, whose colour is an attribute."""
    material, shader, occlusion = _new(f"{name} smooth", group)
    attribute = material.node_tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = COLOUR
    attribute.location = (shader.location.x - 500, shader.location.y)
    material.node_tree.links.new(attribute.outputs["Color"], occlusion.inputs[0])
    shader.inputs["Roughness"].default_value = 1.0
    return material


def _followed(socket):
    """Follows a colour socket through groups. Returns the value of an unlinked socket, or the node that sets it."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.type != "GROUP" or not node.inputs or node.inputs[0].type != "RGBA":
            return None, node
        socket = node.inputs[0]
    return socket.default_value, None


def seen(material):
    """Converts a material to an unnamed type. Also returns the node that sets its colour, if any."""
    shader = None
    if material is not None and material.use_nodes:
        shader = next((node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"), None)
    if shader is None:
        colour = (0.8, 0.8, 0.8, 1.0) if material is None else material.diffuse_color
        return quoin.VoxelType((*(int(v) for v in srgb(colour[:3])), 255)), None
    colour, node = _followed(shader.inputs["Base Color"])
    if colour is None:
        colour = (1.0, 1.0, 1.0) if node.type in _ATTRIBUTES else material.diffuse_color
    clear = versions.input_of(shader, "Transmission").default_value
    alpha = (1.0 - clear) * shader.inputs["Alpha"].default_value
    glow = max(versions.input_of(shader, "Emission").default_value[:3]) > 0.0
    emission = shader.inputs["Emission Strength"].default_value if glow else 0.0
    return quoin.VoxelType((*(int(v) for v in srgb(colour[:3])), int(round(255.0 * alpha))),
                           emission=max(emission, 0.0), metalness=shader.inputs["Metallic"].default_value,
                           roughness=shader.inputs["Roughness"].default_value, transparent=alpha < 1.0,
                           ior=shader.inputs["IOR"].default_value), node


_ATTRIBUTES = {"ATTRIBUTE", "VERTEX_COLOR"}


def has_attribute(node):
    """Returns true if the node reads a colour attribute of the mesh."""
    return node is not None and node.type in _ATTRIBUTES


def edited(one, material):
    """Applies a material's edits to a type. Unedited values stay bit-exact. Types coloured by a node, and clouds, stay
    unchanged."""
    now, node = seen(material)
    if node is not None or one.scattering > 0.0:
        return one
    changes = {}
    if now.rgba[:3] != tuple(one.rgba[:3]):
        changes["rgba"] = (*now.rgba[:3], one.rgba[3])
    if abs(now.rgba[3] - one.rgba[3]) > 1:
        changes.update(rgba=now.rgba, transparent=now.transparent)
    is_clear = changes.get("transparent", one.transparent)
    for name in ("metalness", "roughness", "emission") + (("ior",) if is_clear else ()):
        if abs(getattr(now, name) - getattr(one, name)) > 1e-5 * max(1.0, getattr(one, name)):
            changes[name] = getattr(now, name)
    return one._replace(**changes)
