"""What differs between versions of Blender."""

import bpy


def input_of(principled, name):
    """A socket of the Principled shader, by its name in Blender 3."""
    later = {"Emission": "Emission Color", "Transmission": "Transmission Weight", "Specular": "Specular IOR Level"}
    found = principled.inputs.get(name)
    return found if found is not None else principled.inputs[later[name]]


def group_socket(tree, name, kind, is_input):
    if hasattr(tree, "interface"):
        tree.interface.new_socket(name, in_out="INPUT" if is_input else "OUTPUT", socket_type=kind)
    else:
        (tree.inputs if is_input else tree.outputs).new(kind, name)


def set_faces(mesh, starts, corners_of_each):
    """Where each face's corners begin; later versions know from that how many it has."""
    mesh.polygons.foreach_set("loop_start", starts)
    if bpy.app.version < (3, 6, 0):
        mesh.polygons.foreach_set("loop_total", corners_of_each)


def shade_flat(mesh):
    """Faces are flat unless told otherwise, but for those of Blender 4.1 on."""
    if hasattr(mesh, "shade_flat"):
        mesh.shade_flat()
