"""Voxels in Blender: File > Import > Voxels (Quoin) and File > Export > Voxels (Quoin).

Written for Blender 3.4 and for 4; `versions.py` has what differs between them.
"""

bl_info = {
    "name": "Quoin voxels",
    "author": "The authors of Quoin",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import, File > Export",
    "description": "Reads and writes voxels: .vox, .qb, .gox, worlds of Minecraft's, .vdb and many more",
    "category": "Import-Export",
}

import os
import sys
import time

if "bpy" in locals():  # reloaded, since another version was installed over this one: so is what belongs to it
    for _name in [one for one in sys.modules if one.startswith(__name__ + ".")]:
        globals().pop(_name[len(__name__) + 1:], None)
        del sys.modules[_name]

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

# What the library cannot do here is told by whoever uses it, and leaves the add-on itself in order.
try:
    from . import quoin
except (ImportError, OSError) as error:
    quoin = None
    _missing = f"Quoin's library cannot be loaded here: {error}"


def _pattern(is_wanted):
    if quoin is None:
        return "*.vox"
    return ";".join("*" + ending for one in quoin.formats() if is_wanted(one) for ending in one.extensions)


def _run(operator, work):
    """Does it, and says what went wrong as Blender does."""
    if quoin is None:
        operator.report({"ERROR"}, _missing)
        return {"CANCELLED"}
    try:
        warnings, summary = work()
    except (quoin.QuoinError, OSError, ValueError) as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    except MemoryError:
        operator.report({"ERROR"}, "There is not enough memory for that")
        return {"CANCELLED"}
    for warning in warnings:
        operator.report({"WARNING"}, warning)
    operator.report({"INFO"}, summary)
    return {"FINISHED"}


class QUOIN_OT_import(bpy.types.Operator, ImportHelper):
    """Read voxels: models, scenes, worlds, volumes"""

    bl_idname = "import_scene.quoin"
    bl_label = "Import Voxels"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filter_glob: StringProperty(default=_pattern(lambda one: one.readable), options={"HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})

    scale: FloatProperty(name="Voxel Size", description="Of a voxel, in Blender's units", default=0.1, min=1e-6,
                         soft_max=10.0, subtype="DISTANCE")
    surface: EnumProperty(name="Surface", default="BLOCKS", items=[
        ("BLOCKS", "Blocks", "Cubes, whose faces are merged"),
        ("SMOOTH", "Smooth", "A smooth surface around the voxels, of triangles")])
    materials: EnumProperty(name="Materials", default="AUTO", items=[
        ("AUTO", "Automatic", "One a type of voxel, as far as a file has 256 types; beyond that a palette"),
        ("TYPES", "One a Type", "A material for each type of voxel"),
        ("PALETTE", "Palette", "One material, whose colours and surfaces are in two small images")])
    occlusion: FloatProperty(name="Occlusion", default=0.0, min=0.0, max=1.0, subtype="FACTOR",
                             description="How much of the occlusion that is kept in the attribute Occlusion the "
                                         "materials show. It can be turned later: the node group Quoin Occlusion "
                                         "has it")
    keep_voxels: BoolProperty(name="Keep Voxels", default=True, description="Keep the voxels themselves in the .blend, "
                              "so that export writes them as they were, with those inside")
    lights: BoolProperty(name="Cameras and Lights", default=True, description="Of the file: cameras, lamps, the sun")
    show_hidden: BoolProperty(name="Show Hidden", default=False, description="Show what the file hides")
    frame: IntProperty(name="Frame", default=0, min=0, description="Of an animation in the file")
    radius: IntProperty(name="Radius", default=4, min=1, soft_max=32,
                        description="Of a world: how far around its spawn, in chunks of 64 voxels")
    size: IntProperty(name="Size", default=128, min=1, max=16384,
                      description="Of a file of triangles or a print: voxels along its longest side")
    set_iso: BoolProperty(name="Threshold", default=False, description="Of a volume: what is above is solid; else a "
                          "value between its two groups is found")
    iso: FloatProperty(name="Value", default=0.0)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("scale", "surface", "materials", "occlusion", "keep_voxels", "lights", "show_hidden"):
            layout.prop(self, name)
        box = layout.box()
        box.label(text="Of files that have them")
        for name in ("frame", "radius", "size", "set_iso"):
            box.prop(self, name)
        row = box.row()
        row.enabled = self.set_iso
        row.prop(self, "iso")

    def execute(self, context):
        paths = [os.path.join(self.directory, one.name) for one in self.files if one.name] or [self.filepath]

        def work():
            from . import importer
            begin = time.perf_counter()
            warnings, count = [], 0
            for path in paths:
                made = importer.import_file(context, path, self)
                warnings += made.warnings
                count += made.objects
            return warnings, f"{count} objects in {time.perf_counter() - begin:.2f} s"

        return _run(self, work)


class QUOIN_OT_export(bpy.types.Operator, ExportHelper):
    """Write objects as voxels: those that were imported as they were, others by what they enclose"""

    bl_idname = "export_scene.quoin"
    bl_label = "Export Voxels"
    bl_options = {"REGISTER", "PRESET"}

    filename_ext = ".vox"
    check_extension = None
    filter_glob: StringProperty(default=_pattern(lambda one: one.writable and not one.is_mesh), options={"HIDDEN"})

    scale: FloatProperty(name="Voxel Size", description="Of a voxel, in Blender's units", default=0.1, min=1e-6,
                         soft_max=10.0, subtype="DISTANCE")
    use_selection: BoolProperty(name="Selected Only", default=False, description="Else all that renders show")
    collections: EnumProperty(name="Collections", default="GROUPS", items=[
        ("GROUPS", "As Groups", "A group for each collection with objects in it; layers are the property `layer`"),
        ("LAYERS", "As Layers", "A layer for each collection of the scene's, and groups for those in them"),
        ("NONE", "Not Written", "Objects alone; layers are the property `layer`")])
    hidden: BoolProperty(name="Hidden Voxels", default=True, description="Write objects that were imported and are "
                         "hidden too, hidden, where the format can say that")
    lights: BoolProperty(name="Cameras and Lights", default=True, description="Those that the format holds; a sun, "
                         "cameras, lamps. What it does not hold is said")
    fill: EnumProperty(name="Fill", default="all", items=[
        ("all", "All", "What a mesh encloses, and what it passes through: thin parts stay"),
        ("solid", "Solid", "Voxels whose centre it encloses"),
        ("surface", "Hollow", "Voxels that it passes through")])

    def execute(self, context):
        path = self.filepath
        if not os.path.splitext(path)[1]:
            path += self.filename_ext

        def work():
            from . import exporter
            made = exporter.export_file(context, path, self)
            return made.warnings, f"{made.kept} objects as they were imported, {made.voxelized} voxelized"

        return _run(self, work)


def _import_entry(self, context):
    self.layout.operator(QUOIN_OT_import.bl_idname, text="Voxels (Quoin)")


def _export_entry(self, context):
    self.layout.operator(QUOIN_OT_export.bl_idname, text="Voxels (Quoin)")


_classes = [QUOIN_OT_import, QUOIN_OT_export]
if hasattr(bpy.types, "FileHandler"):  # Blender 4.1: files that are dropped

    class QUOIN_FH_voxels(bpy.types.FileHandler):
        bl_idname = "QUOIN_FH_voxels"
        bl_label = "Voxels (Quoin)"
        bl_import_operator = "import_scene.quoin"
        bl_file_extensions = QUOIN_OT_import.__annotations__["filter_glob"].keywords["default"].replace("*", "")

        @classmethod
        def poll_drop(cls, context):
            return context.area is not None and context.area.type in {"VIEW_3D", "OUTLINER"}

    _classes.append(QUOIN_FH_voxels)


def register():
    for one in _classes:
        bpy.utils.register_class(one)
    bpy.types.TOPBAR_MT_file_import.append(_import_entry)
    bpy.types.TOPBAR_MT_file_export.append(_export_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(_import_entry)
    bpy.types.TOPBAR_MT_file_export.remove(_export_entry)
    for one in reversed(_classes):
        bpy.utils.unregister_class(one)
