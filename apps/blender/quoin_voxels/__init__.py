"""Voxels in Blender: File > Import > Voxels (Quoin) and File > Export > Voxels (Quoin).

Supports Blender 3.4 and 4. `versions.py` handles their differences.
"""

bl_info = {
    "name": "Quoin voxels",
    "author": "The authors of Quoin",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import, File > Export",
    "description": "Imports and exports voxels: .vox, .qb, .gox, Minecraft worlds, .vdb and many more",
    "category": "Import-Export",
}

import os
import sys
import time

if "bpy" in locals():  # reloaded after another version was installed: reload the submodules too
    for _name in [one for one in sys.modules if one.startswith(__name__ + ".")]:
        globals().pop(_name[len(__name__) + 1:], None)
        del sys.modules[_name]

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

# Without the library the add-on still registers; its operators report the error.
try:
    from . import quoin
except (ImportError, OSError) as error:
    quoin = None
    _missing = f"cannot load the Quoin library: {error}"


def _pattern(is_wanted):
    if quoin is None:
        return "*.vox"
    return ";".join("*" + ending for one in quoin.formats() if is_wanted(one) for ending in one.extensions)


def _run(operator, work):
    """Runs `work` and reports its errors and warnings to Blender."""
    if quoin is None:
        operator.report({"ERROR"}, _missing)
        return {"CANCELLED"}
    try:
        warnings, summary = work()
    except (quoin.QuoinError, OSError, ValueError) as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    except MemoryError:
        operator.report({"ERROR"}, "out of memory")
        return {"CANCELLED"}
    for warning in warnings:
        operator.report({"WARNING"}, warning)
    operator.report({"INFO"}, summary)
    return {"FINISHED"}


class QUOIN_OT_import(bpy.types.Operator, ImportHelper):
    """Import voxel models, scenes, worlds and volumes"""

    bl_idname = "import_scene.quoin"
    bl_label = "Import Voxels"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filter_glob: StringProperty(default=_pattern(lambda one: one.readable), options={"HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})

    scale: FloatProperty(name="Voxel Size", description="Edge length of a voxel, in Blender units", default=0.1,
                         min=1e-6, soft_max=10.0, subtype="DISTANCE")
    surface: EnumProperty(name="Surface", default="BLOCKS", items=[
        ("BLOCKS", "Blocks", "Cubes with merged faces"),
        ("SMOOTH", "Smooth", "A smooth triangle mesh around the voxels")])
    materials: EnumProperty(name="Materials", default="AUTO", items=[
        ("AUTO", "Automatic", "One material per voxel type for up to 256 types; otherwise a palette"),
        ("TYPES", "Per Type", "One material per voxel type"),
        ("PALETTE", "Palette", "One material that stores colours and surface properties in two small images")])
    occlusion: FloatProperty(name="Occlusion", default=0.0, min=0.0, max=1.0, subtype="FACTOR",
                             description="How much the attribute Occlusion darkens the materials (0 to 1). To change "
                                         "it later, edit the node group Quoin Occlusion")
    keep_voxels: BoolProperty(name="Keep Voxels", default=True, description="Store the voxels in the .blend file, so "
                              "that export writes them unchanged, including inner voxels")
    lights: BoolProperty(name="Cameras and Lights", default=True, description="Import cameras, lamps and the sun")
    show_hidden: BoolProperty(name="Show Hidden", default=False, description="Show objects that are hidden in the file")
    frame: IntProperty(name="Frame", default=0, min=0, description="Animation frame to import")
    radius: IntProperty(name="Radius", default=4, min=1, soft_max=32,
                        description="Worlds: chunks of 64 voxels to import on each side of the spawn point")
    size: IntProperty(name="Size", default=128, min=1, max=16384,
                      description="Triangle files: voxels along the longest side")
    set_iso: BoolProperty(name="Threshold", default=False, description="Volumes: set the threshold. Default: "
                          "a threshold between the two groups of values")
    iso: FloatProperty(name="Value", default=0.0, description="Volumes: values above it are solid")
    packs: StringProperty(name="Resource Packs", default="", description="Blocks of Minecraft: packs for their shapes "
                          "and textures: folders, zip files or client .jar files, separated by ;, the last one on top. "
                          "builtin is Quoin's own pack, for blocks that the others lack")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("scale", "surface", "materials", "occlusion", "keep_voxels", "lights", "show_hidden"):
            layout.prop(self, name)
        box = layout.box()
        box.label(text="For some file types")
        for name in ("frame", "radius", "packs", "size", "set_iso"):
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
    """Export objects as voxels: imported voxels unchanged, other objects voxelized"""

    bl_idname = "export_scene.quoin"
    bl_label = "Export Voxels"
    bl_options = {"REGISTER", "PRESET"}

    filename_ext = ".vox"
    check_extension = None
    filter_glob: StringProperty(default=_pattern(lambda one: one.writable and not one.is_mesh), options={"HIDDEN"})

    scale: FloatProperty(name="Voxel Size", description="Edge length of a voxel, in Blender units", default=0.1,
                         min=1e-6, soft_max=10.0, subtype="DISTANCE")
    use_selection: BoolProperty(name="Selected Only", default=False,
                                description="Export only selected objects. Default: all objects visible in renders")
    collections: EnumProperty(name="Collections", default="GROUPS", items=[
        ("GROUPS", "As Groups", "A group for each collection with objects. The custom property `layer` assigns layers"),
        ("LAYERS", "As Layers", "A layer for each top-level collection, and groups for the collections in it"),
        ("NONE", "Not Written", "No groups. The custom property `layer` assigns layers")])
    hidden: BoolProperty(name="Hidden Voxels", default=True, description="Also export imported objects that are "
                         "hidden, and keep them hidden if the format supports it")
    lights: BoolProperty(name="Cameras and Lights", default=True, description="Export the sun, cameras and lamps. A "
                         "warning lists those that the format does not support")
    fill: EnumProperty(name="Fill", default="all", items=[
        ("all", "All", "Voxels that are enclosed or touched by the mesh; keeps thin parts"),
        ("solid", "Solid", "Voxels whose centre is enclosed"),
        ("surface", "Hollow", "Voxels touched by the mesh; the inside stays empty")])

    def execute(self, context):
        path = self.filepath
        if not os.path.splitext(path)[1]:
            path += self.filename_ext

        def work():
            from . import exporter
            made = exporter.export_file(context, path, self)
            return made.warnings, f"{made.kept} objects unchanged since import, {made.voxelized} voxelized"

        return _run(self, work)


def _import_entry(self, context):
    self.layout.operator(QUOIN_OT_import.bl_idname, text="Voxels (Quoin)")


def _export_entry(self, context):
    self.layout.operator(QUOIN_OT_export.bl_idname, text="Voxels (Quoin)")


_classes = [QUOIN_OT_import, QUOIN_OT_export]
if hasattr(bpy.types, "FileHandler"):  # Blender 4.1: drag and drop

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
