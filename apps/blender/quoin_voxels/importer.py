"""Imports voxel files: a mesh per grid, an object per instance."""

import math
import os

import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import axes, kept, materials, placements, quoin, versions


# Quoin's own formats, which store intended sizes.
_OUR_OWN = {"scene", "world"}


class Imported:
    """Counts the imported objects; lists warnings."""

    def __init__(self):
        self.objects = 0
        self.warnings = []


_NO_TEXTURE = 2**32 - 1


def _faces_of(form):
    """Returns the textured faces of a type and its shapes, by texture, tint and share of emission."""
    faces = list(form.faces or ())
    for part in form.shapes.parts if form.shapes else ():
        faces += [look for element in part.elements for look in element.looks.values() if isinstance(look, quoin.Face)]
    return {(one.texture, tuple(one.tint), one.emission_share): one for one in reversed(faces)
            if one.image is not None}


class _Looks:
    """The materials of one import, created on first use."""

    def __init__(self, name, scene, options):
        types = scene.types
        self.name, self.types, self.scale = name, types, options.scale
        self.textures = scene.textures()
        self.forms = [kept.Form(self.textures.faces(i), self.textures.shapes(i), scene.orientations(i))
                      for i in range(len(types))]
        self.is_shaped = np.array([one.shapes is not None for one in self.forms])
        self._faces = [_faces_of(one) for one in self.forms]  # of each type, see _faces_of
        self._rows, self._of_rows, self._of_faces, self._images = [], {}, {}, {}
        self.group = materials.occlusion_group(options.occlusion)
        is_palette = options.materials == "PALETTE" or (
            options.materials == "AUTO" and len(types) > materials.MOST_MATERIALS)
        self.palette = materials.Palette(name, types, self.group) if is_palette else None
        self._of = {}
        self._smooth = None

    def of(self, number):
        """Returns the material of a type, or of faces with a look of their own (see `numbers_of`)."""
        if number >= len(self.types):
            return self._of_row(*self._rows[number - len(self.types)])
        one = self.types[number]
        if self.palette is not None and not one.transparent:
            return self.palette.material
        if number not in self._of:
            self._of[number] = materials.of_type(one, number, self.group, self.scale)
        return self._of[number]

    def numbers_of(self, types, textures, tints, shares, is_one_sided):
        """Returns numbers for `of`: the types, and other numbers for faces with a texture, or with a colour or share of
        emission that is not the type's. `is_one_sided`: of faces that are seen from their front only."""
        colours = np.array([one.rgba[:3] for one in self.types], np.uint8)
        # Without emission, shares make no difference.
        emits = np.array([one.emission > 0.0 for one in self.types])
        shares = np.where(emits[types], shares, 255)
        is_own = (textures != _NO_TEXTURE) | (tints[:, :3] != colours[types]).any(1) | (shares != 255)
        found = types.copy()
        if is_own.any():
            kinds, kind = np.unique(textures[is_own], return_inverse=True)
            red, green, blue = tints[is_own, :3].astype(np.int64).T
            packed = (types[is_own] * len(kinds) + kind) << 25 | is_one_sided[is_own] << 24
            packed |= red << 16 | green << 8 | blue
            packed = packed << 8 | shares[is_own]
            packed, row = np.unique(packed, return_inverse=True)
            numbers = []
            for both in packed.tolist():
                each, share = divmod(both, 256)
                number, kind = divmod(each >> 25, len(kinds))
                tint = (each >> 16 & 255, each >> 8 & 255, each & 255)
                key = (number, int(kinds[kind]), tint, share, bool(each >> 24 & 1))
                numbers.append(self._of_rows.setdefault(key, len(self.types) + len(self._rows)))
                if numbers[-1] == len(self.types) + len(self._rows):
                    self._rows.append(key)
            found[is_own] = np.array(numbers)[row]
        return found

    def _of_row(self, number, texture, tint, share, is_one_sided):
        one = self.types[number]
        one = one._replace(emission=one.emission * share / 255.0)
        face = self._faces[number].get((texture, tint, share))
        if face is None and share == 255:  # of a type without emission, whose shares were not compared
            face = next((found for key, found in self._faces[number].items() if key[:2] == (texture, tint)), None)
        if face is None:  # a colour
            key = (tint, *one[2:])
            if key not in self._of_faces:
                coloured = one._replace(rgba=(*tint, one.rgba[3]))
                self._of_faces[key] = materials.of_type(coloured, number, self.group, self.scale)
            return self._of_faces[key]
        is_one_sided = is_one_sided and face.alpha != "opaque"
        key = (face.texture, face.image.shape, face.tint, face.alpha, one.emission, one.metalness, one.roughness,
               is_one_sided)
        if key not in self._of_faces:
            image = key[:3]
            if image not in self._images:
                self._images[image] = materials.texture_image(face)
            self._of_faces[key] = materials.of_face(one, face, self._images[image], self.group, is_one_sided)
        return self._of_faces[key]

    def has_own(self, number):
        return number in self._of

    def smooth(self):
        if self._smooth is None:
            self._smooth = materials.smooth(self.name, self.group)
        return self._smooth


def _quads(triangles):
    """Returns the four corners of each block face, ordered so that Blender splits it along the same diagonal.

    Quoin stores the corners 0 1 2 3 of a face consecutively, with the triangles 0 1 2, 0 2 3 or 1 2 3, 0 1 3."""
    pairs = triangles.reshape(-1, 6)
    first = pairs[:, 0].astype(np.int32)
    base = first & ~3
    return base[:, None] + (((first & 3)[:, None] + np.arange(4, dtype=np.int32)) & 3)


def _edges_of_quads(mesh, quads):
    """Adds four edges per face. Faces share no corners, so no search is needed."""
    edges = np.empty((len(quads), 4, 2), np.int32)
    edges[:, :, 0] = quads
    edges[:, :3, 1] = quads[:, 1:]
    edges[:, 3, 1] = quads[:, 0]
    mesh.edges.add(quads.size)
    mesh.edges.foreach_set("vertices", edges.ravel())
    mesh.loops.foreach_set("edge_index", np.arange(quads.size, dtype=np.int32))
    mesh.update()


def _open(found, blocks):
    """Returns the light that reaches vertices, as in glTF and PLY files: at least 0.25 for blocks."""
    open_ = np.ones(len(found.positions), np.float32)
    if found.occlusion is not None:
        open_ -= found.occlusion
        open_[:blocks] = 1.0 - 0.75 * found.occlusion[:blocks]
    return open_


def _colours(mesh, name, values):
    layer = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.ascontiguousarray(values, np.float32).ravel())


def _slots(mesh, looks, face_types, faces):
    """Assigns materials to the mesh and its faces, by their numbers in `looks`. Returns the slots of types that have
    their own material."""
    occurs = np.flatnonzero(np.bincount(face_types, minlength=1))
    occurs = occurs[occurs > 0]
    slot_of = np.zeros(int(occurs.max(initial=0)) + 1, np.int32)
    place = {}
    for number in occurs:
        material = looks.of(int(number))
        if material.name not in place:
            place[material.name] = len(mesh.materials)
            mesh.materials.append(material)
        slot_of[number] = place[material.name]
    slots = np.zeros(faces, np.int32)
    slots[:len(face_types)] = slot_of[face_types]
    if faces > len(face_types):
        slots[len(face_types):] = len(mesh.materials)
        mesh.materials.append(looks.smooth())
    if len(mesh.materials) > 1:
        mesh.polygons.foreach_set("material_index", slots)
    return {int(number): int(slot_of[number]) for number in occurs if looks.has_own(int(number))}


_GAP = 0.0005  # voxels
_FACTORS = np.random.default_rng(7).integers(1, 2**62, 12) | 1


def _twins(found, quads, is_shaped):
    """Returns a flag per quad: true for the two sides of plates, which are in one plane. `is_shaped`: by type."""
    flags = np.zeros(len(quads), np.int64)
    numbers = np.flatnonzero(is_shaped[found.types[quads[:, 0]]])
    corners = found.positions[quads[numbers]].astype(np.float64)
    normals = np.abs(found.normals[quads[numbers, 0]].astype(np.float64))
    place = np.concatenate([corners.min(1), corners.max(1), corners.mean(1), normals], axis=1)
    # A number per plane and rectangle, wrapped to 64 bits.
    keys = (np.rint(4096.0 * place).astype(np.int64) * _FACTORS).sum(1)
    _, kinds, counts = np.unique(keys, return_inverse=True, return_counts=True)
    flags[numbers] = counts[kinds] > 1
    return flags


def _apart(found, quads, twins):
    """Returns the positions of a mesh with the two sides of plates moved apart, so that they do not shadow each
    other."""
    sides = quads[twins != 0]
    if not len(sides):
        return found.positions
    positions = found.positions.copy()
    positions[sides] += np.float32(_GAP) * found.normals[sides]
    return positions


def mesh_of(grid, name, looks, options):
    """Creates the Blender mesh of a grid, with attributes and materials. Returns it, or None if the grid has no
    surface; and the slots of types that have their own material."""
    found = grid.mesh(smooth=options.surface == "SMOOTH", textures=looks.textures)
    if not len(found.triangles):
        return None, {}
    blocks = 0 if found.types is None else int(np.count_nonzero(found.types))
    quads = _quads(found.triangles[:blocks // 2])
    rest = found.triangles[blocks // 2:].astype(np.int32)
    corners = np.concatenate([quads.ravel(), rest.ravel()])
    faces = len(quads) + len(rest)

    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(found.positions))
    twins = _twins(found, quads, looks.is_shaped) if blocks else np.zeros(0, np.int64)
    mesh.vertices.foreach_set("co", axes.points_to_blender(_apart(found, quads, twins), options.scale).ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(faces)
    starts = np.concatenate([np.arange(len(quads)) * 4, len(quads) * 4 + np.arange(len(rest)) * 3])
    counts = np.full(faces, 3, np.int32)
    counts[:len(quads)] = 4
    versions.set_faces(mesh, starts.astype(np.int32), counts)
    if len(rest):
        is_smooth = np.ones(faces, bool)
        is_smooth[:len(quads)] = False
        mesh.polygons.foreach_set("use_smooth", is_smooth)
    else:
        versions.shade_flat(mesh)

    face_types = np.zeros(0, np.int64) if blocks == 0 else found.types[:blocks:4].astype(np.int64)
    face_looks = face_types
    if found.textures is not None:
        face_looks = looks.numbers_of(face_types, found.textures[:blocks:4], found.tints[:blocks:4],
                                      found.emission_shares[:blocks:4], twins)
    slots = _slots(mesh, looks, face_looks, faces)
    if found.textures is not None:
        layer = mesh.uv_layers.new(name=materials.TEXTURE, do_init=False)
        places = found.texture_uvs[corners]
        places[:, 1] = 1.0 - places[:, 1]  # from the bottom
        layer.data.foreach_set("uv", places.ravel())
    if looks.palette is not None and blocks:
        layer = mesh.uv_layers.new(name="Palette", do_init=False)
        places = np.zeros((len(corners), 2), np.float32)
        places[:len(quads) * 4] = np.repeat(looks.palette.places(face_types), 4, axis=0)
        layer.data.foreach_set("uv", places.ravel())
        layer.active = layer.active_render = True  # the palette's material has no node for coordinates
    if len(rest):
        light = np.ones((len(found.positions), 4), np.float32)
        table = materials.linear(np.arange(256)).astype(np.float32)
        light[:, :3] = table[found.colours[:, :3]]
        _colours(mesh, materials.COLOUR, light)
    _colours(mesh, materials.OCCLUSION, np.broadcast_to(_open(found, blocks)[:, None], (len(found.positions), 4)))
    if len(rest):
        mesh.update(calc_edges=True)
    else:
        _edges_of_quads(mesh, quads)
    return mesh, slots


def _keep(mesh, grid, looks, slots, options, made):
    if not options.keep_voxels or not grid.voxel_count:
        return
    if not kept.keep(mesh, grid, looks.types, options.scale, slots, looks.forms):
        made.warnings.append(f"{mesh.name}: cannot keep the voxels in the .blend: too many or too scattered; export "
                             "will voxelize the mesh")


def _collections(scene, top):
    """Creates a collection per group, nested like the groups, hidden if the group's own flag hides it."""
    found = []
    groups = scene.groups
    hidden = {one.name for one in scene.layers if not one.visible}
    for group in groups:
        one = bpy.data.collections.new(group.name or "group")
        (top if group.parent is None else found[group.parent]).children.link(one)
        above = group.parent is None or groups[group.parent].shown
        one.hide_render = one.hide_viewport = above and not group.shown and group.layer not in hidden
        if group.layer:
            one[placements.LAYER] = group.layer
        found.append(one)
    placements.set_layers(top, scene.layers)
    return found


def _hidden_groups(scene, collections):
    """Returns the numbers of groups hidden by their collection or one above it."""
    hidden = set()
    for i, group in enumerate(scene.groups):
        if collections[i].hide_render or group.parent in hidden:
            hidden.add(i)
    return hidden


def _camera(one, name, options, reach):
    data = bpy.data.cameras.new(name)
    data.sensor_fit = "VERTICAL"
    if one.view_height is None:
        data.angle_y = math.radians(one.fov)
    else:
        data.type, data.ortho_scale = "ORTHO", one.view_height * options.scale
    if one.focus_distance > 0.0:
        data.dof.focus_distance = one.focus_distance * options.scale
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = one.right, one.up, -np.array(one.forward)
    matrix[:3, 3] = one.position
    # Camera axes are the same in both.
    matrix = axes.BLENDER_FROM_QUOIN @ matrix
    matrix[:3, 3] *= options.scale
    data.clip_end = max(data.clip_end, 2.0 * (np.linalg.norm(matrix[:3, 3]) + reach))
    made = bpy.data.objects.new(name, data)
    made.matrix_world = Matrix(matrix)
    made[placements.CAMERA] = one.number
    return made


def _towards(direction):
    """Returns the rotation of a light, which shines along its -z."""
    along = axes.BLENDER_FROM_QUOIN[:3, :3] @ np.asarray(direction, float)
    return Vector(along).to_track_quat("-Z", "Y").to_matrix().to_4x4()


def _lamp(one, name, options):
    data = bpy.data.lights.new(one.name or name, "POINT" if one.direction is None else "SPOT")
    data.color = one.colour
    # A white surface facing the lamp at distance 1 receives `intensity`; in Blender a lamp of power P gives
    # P / (4 pi^2).
    data.energy = one.intensity * 4.0 * math.pi ** 2 * options.scale ** 2
    data.shadow_soft_size = 0.0
    made = bpy.data.objects.new(data.name, data)
    matrix = Matrix()
    if one.direction is not None:
        data.spot_size = math.radians(min(2.0 * one.outer_angle, 180.0))
        data.spot_blend = 1.0 - min(one.inner_angle / max(one.outer_angle, 1e-6), 1.0)
        matrix = _towards(one.direction)
    matrix.translation = axes.BLENDER_FROM_QUOIN[:3, :3] @ np.array(one.position) * options.scale
    made.matrix_world = matrix
    return made


def _sun(sun):
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy = math.pi * sun.brightness  # a white surface facing the sun has this brightness
    data.color = sun.colour
    data.angle = math.radians(sun.angle)
    made = bpy.data.objects.new("Sun", data)
    made.matrix_world = _towards([-v for v in sun.direction])
    return made


def _lights(context, scene, top, name, options, made):
    least, most = scene.bounds
    reach = float(np.linalg.norm(np.abs([least, most]).max(0))) * options.scale
    found = []
    cameras = scene.cameras
    for i, one in enumerate(cameras):
        found.append(_camera(one, f"{name} camera {one.number}" if i else f"{name} camera", options, reach))
    if cameras and context.scene.camera is None:
        first = next((i for i, one in enumerate(cameras) if one.first), 0)
        context.scene.camera = found[first]
    found += [_lamp(one, f"{name} lamp", options) for one in scene.lamps]
    if scene.sun_light is not None:
        found.append(_sun(scene.sun_light))
    for one in found:
        top.objects.link(one)
        made.objects += 1


def _on_lattice(scene, matrix):
    """Scales and snaps the only instance of a file with its own unit, such as a triangle file, to the voxel lattice.
    Returns other matrices unchanged."""
    size = np.cbrt(abs(np.linalg.det(matrix[:3, :3])))
    if (abs(size - 1.0) < 1e-6 or scene.format in _OUR_OWN or len(scene.instances) != 1
            or not scene.grids[0].voxel_count):
        return matrix
    out = matrix / size
    out[:3, 3] = np.round(out[:3, 3])
    out[3, 3] = 1.0
    return out


def _place(scene, top, name, looks, options, made, progress):
    groups = _collections(scene, top)
    grids, instances, meshes = scene.grids, scene.instances, {}
    hidden_groups = _hidden_groups(scene, groups)
    empty = 0
    for i, one in enumerate(instances):
        if one.grid not in meshes:
            grid = grids[one.grid]
            mesh, slots = mesh_of(grid, grid.name or one.name or name, looks, options)
            if mesh is not None:
                _keep(mesh, grid, looks, slots, options, made)
            meshes[one.grid] = mesh
            progress(i / len(instances))
        mesh = meshes[one.grid]
        if mesh is None:
            empty += 1
            continue
        made_object = bpy.data.objects.new(one.name or mesh.name, mesh)
        made_object.matrix_world = Matrix(axes.matrix_to_blender(_on_lattice(scene, one.matrix), options.scale))
        is_shown = one.shown or one.group in hidden_groups  # their collections hide these
        made_object.hide_render = made_object.hide_viewport = not (one.visible and is_shown)
        if one.layer:
            made_object[placements.LAYER] = one.layer
        (top if one.group is None else groups[one.group]).objects.link(made_object)
        made.objects += 1
    if empty:
        made.warnings.append(f"{name}: {empty} instances of empty grids are left out")
    if unplaced := len(grids) - len(meshes):
        made.warnings.append(f"{name}: {unplaced} grids without instances are left out")


def packs_of(text):
    """Returns the resource packs that the user names, the lowest first. A path with // is relative to the .blend."""
    named = [one.strip() for one in text.split(";")]
    return [os.path.expanduser(bpy.path.abspath(one)) for one in named if one]


def import_file(context, path, options):
    """Imports a file into a new collection. `options` is the import operator."""
    scene = quoin.load(path, frame=options.frame, show_hidden=options.show_hidden, radius=options.radius,
                       iso=options.iso if options.set_iso else None, size=options.size,
                       packs=packs_of(options.packs))
    made = Imported()
    name = os.path.splitext(os.path.basename(os.path.normpath(path)))[0]
    made.warnings += [f"{name}: {line}" for line in scene.warnings]
    top = bpy.data.collections.new(name)
    top[placements.FILE] = name
    context.scene.collection.children.link(top)
    looks = _Looks(name, scene, options)
    if options.surface == "SMOOTH" and any(one.transparent or one.emission > 0.0 for one in looks.types):
        made.warnings.append(f"{name}: smooth surfaces are opaque and do not emit light; the file has transparent or "
                             "emissive types")
    window = context.window_manager
    window.progress_begin(0.0, 1.0)
    try:
        _place(scene, top, name, looks, options, made, window.progress_update)
    finally:
        window.progress_end()
    if options.lights:
        _lights(context, scene, top, name, options, made)
    return made
