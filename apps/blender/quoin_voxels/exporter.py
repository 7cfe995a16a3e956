"""Blender's objects as files of voxels: those that were imported as they were, others voxelized."""

import numpy as np

from . import axes, kept, materials, quoin


class Exported:
    """What an export wrote, and what it left out."""

    def __init__(self):
        self.kept = 0
        self.voxelized = 0
        self.warnings = []


class _Writer:
    def __init__(self, path, options):
        self.options = options
        self.scene = quoin.Scene()
        self.is_vox = path.lower().endswith(".vox")
        self.made = Exported()
        self._types = {}  # numbers in the scene
        self._grids = {}  # by mesh and materials
        self._places = 0

    def type_number(self, one):
        key = tuple(one)
        if key not in self._types:
            self._types[key] = self.scene.add_type(one)
        return self._types[key]

    def can_place(self, matrix):
        """Whether the format has a place for a grid that stands so; others are voxelized where they are."""
        linear = matrix[:3, :3]
        if self.is_vox:
            return bool((np.abs(linear).sum(0) == 1.0).all() and (np.abs(linear).sum(1) == 1.0).all()
                        and (matrix == np.round(matrix)).all())
        size = np.cbrt(abs(np.linalg.det(linear)))
        return size > 0.0 and np.allclose(linear.T @ linear, size * size * np.eye(3), atol=1e-5 * size * size)

    def add_kept(self, source, matrix, name):
        """Places the voxels that a mesh carries."""
        mesh = source.data
        key = (mesh.name_full, tuple(slot.material.name_full if slot.material else "" for slot in source.material_slots))
        if key not in self._grids:
            found = kept.Kept(mesh)
            types = [materials.edited(one, source.material_slots[slot].material) if 0 <= slot < len(source.material_slots)
                     else one for one, slot in zip(found.types, found.slots)]
            numbers = np.array([0] + [self.type_number(one) for one in types], np.uint16)
            grid = self.scene.add(numbers[found.voxels], name=mesh.name)
            # It stands where its array begins; grids begin at 0.
            moved = np.eye(4)
            moved[:3, 3] = found.origin
            self._grids[key] = (grid, moved)
            self.scene.move(self._places, matrix @ moved, name=name)
        else:
            grid, moved = self._grids[key]
            self.scene.place(grid, matrix @ moved, name)
        self._places += 1
        self.made.kept += 1

    def add_voxelized(self, evaluated, world, name):
        """Voxelizes what an object looks like."""
        mesh = evaluated.to_mesh()
        if mesh is None:
            return
        try:
            self._voxelize(mesh, [slot.material for slot in evaluated.material_slots], world, name)
        finally:
            evaluated.to_mesh_clear()

    def _voxelize(self, mesh, slots, world, name):
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
        if np.linalg.det(world[:3, :3]) < 0.0:
            triangles = triangles[:, ::-1]
        points = points.astype(np.float64) @ world[:3, :3].T + world[:3, 3]
        looks = [materials.seen(one) for one in slots or [None]]
        types, numbers = [one for one, _ in looks], np.minimum(numbers, len(looks) - 1)
        colours = None
        if any(materials.has_attribute(node) for _, node in looks):
            colours = _colours_of(mesh)
        for slot, (one, node) in enumerate(looks):
            if node is None or (materials.has_attribute(node) and colours is not None):
                continue
            texels = _texels_of(mesh, node, np.flatnonzero(numbers == slot))
            if texels is None:
                self.made.warnings.append(f"{name}: what colours {slots[slot].name} is left out; its viewport colour stands "
                                          "for it")
                continue
            found, which = np.unique(texels, axis=0, return_inverse=True)
            numbers[numbers == slot] = len(types) + which.ravel()
            types += [one._replace(rgba=(*(int(v) for v in rgb), one.rgba[3])) for rgb in found]
            if node.interpolation != "Closest":
                self.made.warnings.append(f"{name}: of the texture of {slots[slot].name} a triangle has one colour")
        self.scene.voxelize(axes.points_to_quoin(points, self.options.scale), triangles,
                            types=types, colours=colours, fill=self.options.fill, name=name, materials=numbers)
        self._places += 1
        self.made.voxelized += 1


def _colours_of(mesh):
    """The colours of its vertices, in linear light; None where it has none."""
    layer = mesh.color_attributes.get(materials.COLOUR) or mesh.color_attributes.active_color
    if layer is None:
        return None
    values = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color", values.ravel())
    if layer.domain == "POINT":
        return values
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    out = np.ones((len(mesh.vertices), 4), np.float32)
    out[corners] = values
    return out


def _texels_of(mesh, node, triangles):
    """The colours, sRGB bytes (n, 3), that a texture has in the middle of triangles; None where there is no such texture."""
    layer = mesh.uv_layers.active
    image = node.image if node.type == "TEX_IMAGE" else None
    if image is None or layer is None or not image.size[0]:
        return None
    corners = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    places = np.empty((len(mesh.loops), 2), np.float32)
    layer.data.foreach_get("uv", places.ravel())
    middle = places[corners[triangles]].mean(1) % 1.0
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)
    colours = pixels[(middle[:, 1] * height).astype(int), (middle[:, 0] * width).astype(int)]
    colours = np.repeat(colours, 3, axis=1) if image.channels < 3 else colours[:, :3]
    return materials.srgb(colours) if image.is_float else np.rint(255.0 * colours).astype(int)


_SOLID = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


def _is_wanted(one, options):
    source = one.instance_object.original if one.is_instance else one.object.original
    owner = one.parent.original if one.is_instance else source
    if source.type not in _SOLID or (one.is_instance is False and not one.show_self):
        return False
    if options.use_selection:
        return owner.select_get()
    return not owner.hide_render


def export_file(context, path, options):
    """Writes what the scene shows as a file, in the format of its name's ending."""
    graph = context.evaluated_depsgraph_get()
    writer = _Writer(path, options)
    for one in graph.object_instances:
        if not _is_wanted(one, options):
            continue
        evaluated = one.object
        source = evaluated.original
        world = np.array(one.matrix_world)
        name = source.name
        if source.type == "MESH" and kept.is_kept(source.data) and not source.modifiers:
            matrix = axes.matrix_to_quoin(world, kept.scale_of(source.data), options.scale)
            if writer.can_place(matrix):
                writer.add_kept(source, matrix, name)
                continue
            writer.made.warnings.append(f"{name}: .vox has no place for voxels that are turned or scaled so; it is voxelized")
        writer.add_voxelized(evaluated, world, name)
    if writer.made.kept + writer.made.voxelized == 0:
        raise ValueError("There is nothing to export" + (": nothing is selected" if options.use_selection else ""))
    writer.scene.save(path)
    writer.made.warnings += writer.scene.warnings
    return writer.made
