"""Exports Blender's cameras and lights."""

import math

import numpy as np

from . import axes, placements, quoin

_CAMERAS = {".quoin", ".vox"}
_ONE_CAMERA = {".json"}
_LAMPS = {".json", ".quoin"}
_SUN = {".json", ".quoin", ".vox"}


def _is_seen(one, tree, options):
    if options.use_selection and not one.select_get():
        return False
    return not tree.is_hidden_object(one)


def _axes_of(one):
    """Returns an object's right, up and backward unit vectors in Quoin's axes, and its position in Blender units."""
    matrix = axes.QUOIN_FROM_BLENDER @ np.array(one.matrix_world)
    back = matrix[:3, 2] / (np.linalg.norm(matrix[:3, 2]) or 1.0)
    right = matrix[:3, 0] - back * np.dot(matrix[:3, 0], back)
    right /= np.linalg.norm(right) or 1.0
    return right, np.cross(back, right), back, matrix[:3, 3]


def _camera(one, number, is_first, blender_scene, options):
    data = one.data
    right, up, back, place = _axes_of(one)
    frame = np.array([tuple(corner) for corner in data.view_frame(scene=blender_scene)])
    height = float(frame[:, 1].max() - frame[:, 1].min())
    is_flat = data.type == "ORTHO"
    fov = 2.0 * math.degrees(math.atan2(height / 2.0, -float(frame[0, 2])))
    focus = data.dof.focus_distance
    if data.dof.focus_object is not None:
        towards = np.array(data.dof.focus_object.matrix_world)[:3, 3] - np.array(one.matrix_world)[:3, 3]
        focus = float(np.dot(axes.QUOIN_FROM_BLENDER[:3, :3] @ towards, -back))
    return quoin.Camera(tuple(place / options.scale), tuple(right), tuple(up), tuple(-back), 45.0 if is_flat else fov,
                        height / options.scale if is_flat else None, max(focus, 0.0) / options.scale, number, is_first)


def _cameras(context, scene, ending, tree, options, left_out):
    active = context.scene.camera
    found = [one for one in context.scene.objects if one.type == "CAMERA" and _is_seen(one, tree, options)]
    found.sort(key=lambda one: one != active)  # the render camera comes first
    warnings, numbers = [], set()
    wanted = {one.get(placements.CAMERA) for one in found}
    for one in found:
        if ending not in _CAMERAS and not (ending in _ONE_CAMERA and one == found[0]):
            left_out.append(f"camera {one.name}")
            continue
        if one.data.type not in ("PERSP", "ORTHO"):
            left_out.append(f"panoramic camera {one.name}")
            continue
        number = one.get(placements.CAMERA)
        if not isinstance(number, int) or number < 0 or number in numbers:
            number = next(i for i in range(len(found) + len(wanted) + 1) if i not in numbers and i not in wanted)
        numbers.add(number)
        if one.data.shift_x or one.data.shift_y:
            warnings.append(f"camera {one.name}: the shifted lens is not supported and is left out")
        scene.add_camera(_camera(one, number, one == found[0], context.scene, options))
    return warnings


def _lamp(one, options):
    data = one.data
    right, up, back, place = _axes_of(one)
    colour = np.array(data.color, float)
    is_spot = data.type == "SPOT"
    outer = math.degrees(data.spot_size) / 2.0 if is_spot else 45.0
    inner = outer * (1.0 - data.spot_blend) if is_spot else 0.0
    # A white surface facing the lamp at distance 1 receives `intensity`; in Blender a lamp of power P gives
    # P / (4 pi^2).
    intensity = max(data.energy, 0.0) / (4.0 * math.pi ** 2 * options.scale ** 2)
    return quoin.Lamp(one.name, tuple(place / options.scale), tuple(-back) if is_spot else None, tuple(colour),
                      intensity, inner_angle=inner, outer_angle=outer)


def _lights(context, scene, ending, tree, options, left_out):
    found = [one for one in context.scene.objects if one.type == "LIGHT" and _is_seen(one, tree, options)]
    suns = [one for one in found if one.data.type == "SUN" and one.data.energy > 0.0]
    soft = []
    suns.sort(key=lambda one: -one.data.energy)
    for one in found:
        kind = one.data.type
        if kind == "SUN" and one in suns[:1] and ending in _SUN:
            right, up, back, place = _axes_of(one)
            scene.set_sun(quoin.Sun(tuple(back), one.data.energy / math.pi, tuple(one.data.color),
                                    min(math.degrees(one.data.angle), 170.0)))
        elif kind == "SUN":
            left_out.append(f"sun {one.name}")
        elif kind in ("POINT", "SPOT") and ending in _LAMPS:
            scene.add_lamp(_lamp(one, options))
            if one.data.shadow_soft_size > 0.0:
                soft.append(one.name)
        else:
            left_out.append(f"{kind.lower()} light {one.name}")
    return ["lights lose their size and become points: " + ", ".join(soft)] if soft else []


def write(context, scene, ending, tree, options):
    """Adds the visible cameras and lights to a Quoin scene. Returns warnings that name those left out."""
    left_out = []
    warnings = _cameras(context, scene, ending, tree, options, left_out)
    warnings += _lights(context, scene, ending, tree, options, left_out)
    if left_out:
        warnings.append(f"{ending} does not support, and leaves out: " + ", ".join(left_out))
    return warnings
