"""Exports Blender objects to voxel files: imported voxels unchanged, other objects voxelized."""

import hashlib
import os

import numpy as np

from . import axes, kept, materials, merging, placements, quoin, views


class Exported:
    """Counts the exported objects; lists warnings."""

    def __init__(self):
        self.kept = 0
        self.voxelized = 0
        self.warnings = []


# Formats with any rotation, position and scale. Others have quarter turns and integer positions.
_ANY_PLACE = {".json", ".quoin"}


# Formats with groups, layers and hidden objects.
_GROUPS = {".json", ".quoin", ".vox"}


def _comparable(one):
    """Converts faces and shapes to values that can be compared: images become hashes."""
    if isinstance(one, np.ndarray):
        return hashlib.sha256(one).digest()
    if isinstance(one, quoin.Face):
        return tuple(map(_comparable, one[:6]))
    if isinstance(one, dict):
        return tuple(sorted((name, _comparable(each)) for name, each in one.items()))
    return tuple(map(_comparable, one)) if isinstance(one, tuple) else one


class _Writer:
    def __init__(self, path, options):
        self.options = options
        self.scene = quoin.Scene()
        self.belonging = None
        self.ending = os.path.splitext(path)[1].lower()
        self.made = Exported()
        self._types = {}  # numbers in the scene
        self._grids = {}  # by mesh and materials
        self._places = 0

    def type_number(self, one, form):
        key = (tuple(one), _comparable(form))
        if key in self._types:
            return self._types[key]
        number = self._types[key] = self.scene.add_type(one)
        if form.faces is not None:
            self.scene.set_faces(number, form.faces)
        if form.orientations is not None:
            self.scene.set_orientations(number, form.orientations)
        if form.shapes is not None:
            self.scene.set_shapes(number, form.shapes)
            if one.blocks_light is not None:
                self.scene.set_type(number, self.scene.types[number]._replace(blocks_light=one.blocks_light))
        return number

    def can_place(self, matrix):
        """Returns true if the format supports this placement. Otherwise the object is voxelized in place."""
        linear = matrix[:3, :3]
        if self.ending not in _ANY_PLACE:
            return bool((np.abs(linear).sum(0) == 1.0).all() and (np.abs(linear).sum(1) == 1.0).all()
                        and (matrix == np.round(matrix)).all())
        size = np.cbrt(abs(np.linalg.det(linear)))
        return size > 0.0 and np.allclose(linear.T @ linear, size * size * np.eye(3), atol=1e-5 * size * size)

    def _belong(self, owner, is_hidden=False):
        """Assigns the next instance to its owner's groups and layer. Returns the instance's own visibility flag."""
        number = self._places
        self._places += 1
        return self.belonging is None or self.belonging.add(number, owner, is_hidden)

    def add_kept(self, source, matrix, name, owner, is_hidden=False):
        """Adds an instance of the voxels stored in a mesh."""
        mesh = source.data
        slots = [slot.material for slot in source.material_slots]
        key = (mesh.name_full, tuple(one.name_full if one else "" for one in slots))
        if key not in self._grids:
            found = kept.Kept(mesh)
            types = [materials.edited(one, slots[slot]) if 0 <= slot < len(slots) else one
                     for one, slot in zip(found.types, found.slots)]
            self._warn_of_images(slots, {slot for slot in found.slots if slot >= 0}, name)
            numbers = np.array([0] + [self.type_number(*one) for one in zip(types, found.forms)], np.uint16)
            grid = self.scene.add(numbers[found.voxels], name=mesh.name)
            if found.states is not None:
                grid.write_states(found.states, (0, 0, 0))
            # The array starts at `origin`; grids start at 0.
            moved = np.eye(4)
            moved[:3, 3] = found.origin
            self._grids[key] = (grid, moved)
            self.scene.move(self._places, matrix @ moved, name=name)
        else:
            grid, moved = self._grids[key]
            self.scene.place(grid, matrix @ moved, name)
        if not self._belong(owner, is_hidden):
            self.scene.move(self._places - 1, matrix @ moved, visible=False)
        self.made.kept += 1

    def _warn_of_images(self, slots, own, name):
        # `own`: slots with one type each.
        for slot, material in enumerate(slots):
            if material is None:
                continue
            if slot in own and materials.seen(material)[1] is not None:
                self.made.warnings.append(f"{name}: the colour texture of {material.name} is ignored; its type stays "
                                          "as imported")
            elif materials.is_edited_palette(material):
                self.made.warnings.append(f"{name}: the edited images of {material.name} are ignored; its types stay "
                                          "as imported")

    def add_voxelized(self, evaluated, world, name, owner):
        """Voxelizes an object as evaluated, with its modifiers."""
        mesh = evaluated.to_mesh()
        if mesh is None:
            return
        try:
            self._voxelize(mesh, [slot.material for slot in evaluated.material_slots], world, name, owner)
        finally:
            evaluated.to_mesh_clear()

    def _voxelize(self, mesh, slots, world, name, owner):
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        if count == 0:
            return
        points = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", points.ravel())
        triangles = np.empty((count, 3), np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
        numbers = np.zeros(count, np.int32)
        mesh.loop_triangles.foreach_get("material_index", numbers)
        is_mirrored = np.linalg.det(world[:3, :3]) < 0.0
        if is_mirrored:
            triangles = triangles[:, ::-1]
        points = points.astype(np.float64) @ world[:3, :3].T + world[:3, 3]
        looks = [materials.seen(one) for one in slots or [None]]
        numbers = np.clip(numbers, 0, len(looks) - 1)
        types, colours = self._colour(mesh, slots, looks, numbers, name)
        if colours is not None:  # corners have colours of their own
            points = points[triangles].reshape(-1, 3)
            triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
            if is_mirrored:
                colours = colours[:, ::-1]
            colours = colours.reshape(-1, 4)
        self.scene.voxelize(axes.points_to_quoin(points, self.options.scale), triangles,
                            types=types, colours=colours, fill=self.options.fill, name=name, materials=numbers)
        self._belong(owner)
        self.made.voxelized += 1

    def _colour(self, mesh, slots, looks, numbers, name):
        """Returns the types of slots, and the colours that multiply them at triangle corners: (n, 3, 4) in linear
        light, or None."""
        types, colours = [one for one, _ in looks], None
        for slot, (one, node) in enumerate(looks):
            own = np.flatnonzero(numbers == slot)
            if node is None or not len(own):
                continue
            if materials.has_attribute(node):
                found = _colours_of(mesh, node)
                found = None if found is None else found[own]
            else:
                found = _texels_of(mesh, node, own)
                found = None if found is None else materials.opaque(found)[:, None]
            if found is None:
                self.made.warnings.append(f"{name}: cannot export the colours of {slots[slot].name}; its viewport "
                                          "colour is used")
                continue
            if colours is None:
                colours = np.ones((len(numbers), 3, 4), np.float32)
            colours[own] = found
            types[slot] = one._replace(rgba=(255, 255, 255, one.rgba[3]))
            if not materials.has_attribute(node) and node.interpolation != "Closest":
                self.made.warnings.append(f"{name}: the texture of {slots[slot].name} is sampled once per triangle")
        return types, colours


def _colours_of(mesh, node):
    """Returns the colours that a node gives the triangle corners, (n, 3, 4) in linear light, or None."""
    named = node.attribute_name if node.type == "ATTRIBUTE" else node.layer_name
    found = mesh.color_attributes
    layer = found.get(named) or found.get(materials.COLOUR) or found.active_color
    if layer is None:
        return None
    values = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color", values.ravel())
    values[:, 3] = 1.0  # alpha comes from the material
    corners = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices" if layer.domain == "POINT" else "loops", corners.ravel())
    return values[corners]


def _place_in(share, size):
    """Converts coordinates in [0, 1) to pixel indices of a row or column."""
    return np.minimum((np.nan_to_num(share) * size).astype(int), size - 1)


def _texels_of(mesh, node, triangles):
    """Samples a texture at triangle centres: sRGB bytes (n, 3), or None without a texture."""
    layer = mesh.uv_layers.active
    image = node.image if node.type == "TEX_IMAGE" else None
    if image is not None and node.inputs["Vector"].is_linked:
        source = node.inputs["Vector"].links[0].from_node
        layer = mesh.uv_layers.get(source.uv_map, layer) if source.type == "UVMAP" else layer
    if image is None or layer is None or not image.size[0]:
        return None
    corners = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    places = np.empty((len(mesh.loops), 2), np.float32)
    layer.data.foreach_get("uv", places.ravel())
    with np.errstate(invalid="ignore"):  # NaN coordinates use the first pixel
        middle = places[corners[triangles]].mean(1) % 1.0
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)
    colours = pixels[_place_in(middle[:, 1], height), _place_in(middle[:, 0], width)]
    colours = np.repeat(colours, 3, axis=1) if image.channels < 3 else colours[:, :3]
    return materials.srgb(colours) if image.is_float else np.rint(255.0 * colours).astype(int)


_SOLID = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


def _owner(one):
    """Returns the scene object that an evaluated instance belongs to."""
    return one.parent.original if one.is_instance else one.object.original


def _is_wanted(one, options, tree):
    source = one.instance_object.original if one.is_instance else one.object.original
    owner = _owner(one)
    if source.type not in _SOLID or (one.is_instance is False and not one.show_self):
        return False
    if options.use_selection:
        return owner.select_get()
    return not owner.hide_render and not tree.is_hidden(tree.path(owner))


def _is_changed(source):
    """Returns true if modifiers or shape keys change the object's mesh."""
    return bool(source.modifiers) or source.data.shape_keys is not None


def _hidden(context, options, tree):
    """Returns the hidden objects with stored voxels."""
    if options.use_selection or not options.hidden:
        return []
    return [one for one in context.scene.objects
            if one.type == "MESH" and kept.is_kept(one.data) and not _is_changed(one)
            and tree.is_hidden_object(one)]


def _add_hidden(writer, hidden, options):
    for source in hidden:
        matrix = axes.matrix_to_quoin(np.array(source.matrix_world), kept.scale_of(source.data), options.scale)
        if writer.can_place(matrix):
            writer.add_kept(source, matrix, source.name, source, True)
        else:
            writer.made.warnings.append(f"{source.name}: the hidden object is left out, because {writer.ending} does "
                                        "not support its rotation or scale")


def _add_seen(writer, one, options):
    evaluated, owner = one.object, _owner(one)
    source, world = evaluated.original, np.array(one.matrix_world)
    name = source.name
    if source.type == "MESH" and kept.is_kept(source.data) and not _is_changed(source):
        matrix = axes.matrix_to_quoin(world, kept.scale_of(source.data), options.scale)
        if writer.can_place(matrix):
            writer.add_kept(source, matrix, name, owner)
            return
        writer.made.warnings.append(f"{name}: voxelized, because {writer.ending} does not support its rotation or "
                                    "scale")
    writer.add_voxelized(evaluated, world, name, owner)


def export_file(context, path, options):
    """Writes the visible scene to a file, in the format of its extension."""
    for one in context.scene.objects:
        if one.type == "MESH" and one.mode == "EDIT":
            one.update_from_editmode()
            one.data.update_tag()
    graph = context.evaluated_depsgraph_get()
    writer = _Writer(path, options)
    tree = placements.Tree(context.view_layer)
    hidden = _hidden(context, options, tree) if writer.ending in _GROUPS else []
    if writer.ending in _GROUPS:
        owners = [_owner(one) for one in graph.object_instances if _is_wanted(one, options, tree)]
        writer.belonging = placements.Belonging(writer.scene, context.scene, tree, options.collections, owners)
    for one in graph.object_instances:
        if _is_wanted(one, options, tree):
            _add_seen(writer, one, options)
    _add_hidden(writer, hidden, options)
    if writer.made.kept + writer.made.voxelized == 0:
        raise ValueError("cannot export: " + ("nothing is selected" if options.use_selection else "nothing is visible"))
    if options.lights:
        writer.made.warnings += views.write(context, writer.scene, writer.ending, tree, options)
    if merged := merging.merge(writer.scene, writer.ending):
        writer.made.warnings.append(f"{writer.ending} supports at most {merging.MOST_TYPES[writer.ending]} types; "
                                    f"merged similar colours of {merged} types")
    writer.scene.save(path)
    writer.made.warnings += writer.scene.warnings
    return writer.made
