"""Textures, shapes and orientations of voxel types."""

from __future__ import annotations

import ctypes
import types
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _c
from ._c import NdArray

_ALPHAS = ("opaque", "cutout", "translucent")
DIRECTIONS = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")
_KINDS = ("", "about_y", "along_axes", "to_directions", "about_y_and_upside_down")
_NEIGHBOURS = ("none", "connected", "stairs", "fluid")
_CORNERS = (None, "straight", "outer_left", "outer_right", "inner_left", "inner_right")
_NOTHING: Mapping[str, Any] = types.MappingProxyType({})


class Face(NamedTuple):
    """One face of a voxel type: a texture that covers the face of a voxel once.

    Turn 0 shows the texture to a viewer outside like this: on the four sides, its top is at +Y; on +Y its right is at
    +Z and its top at +X; on -Y its right is at +X and its top at +Z.
    """

    #: uint8, (size, size, 4) or (size, size, 3), rows from the top: sRGB with linear alpha. None, for looks of shapes:
    #: the colour `tint`
    image: Optional[NdArray]
    name: str = ""  #: of the texture
    turn: int = 0  #: clockwise quarter turns for a viewer outside, 0 to 3
    mirrored: bool = False  #: exchanges left and right, before the turn
    tint: Tuple[int, ...] = (255, 255, 255)  #: sRGB; multiplies the texture in linear light
    alpha: str = "opaque"  #: "opaque", "cutout" (texels are visible or not) or "translucent"
    texture: Optional[int] = None  #: result of `Textures.faces`: the number in `Mesh.textures`
    emission_share: int = 255  #: share of the type's emission, in 255ths: 0 none, 255 all


Look = Union[Face, Tuple[int, ...], None]


class Turn(NamedTuple):
    """A turn of an element about an axis."""

    degrees: float  #: counter-clockwise, seen from the positive end of the axis
    axis: int = 1  #: 0 x, 1 y, 2 z
    origin: Tuple[float, ...] = (8.0, 8.0, 8.0)  #: a point of the axis, in sixteenths
    rescales: bool = False  #: stretches the element across the axis by 1 / cos(degrees)


class Element(NamedTuple):
    """A box of a shape. Lengths are sixteenths: a voxel spans 0 to 16 on each axis, and a box may reach from -16 to 32.
    Directions are "+X", "-X", "+Y", "-Y", "+Z" and "-Z", before the turn."""

    min: Tuple[float, ...] = (0.0, 0.0, 0.0)
    max: Tuple[float, ...] = (16.0, 16.0, 16.0)  #: equal to `min` along one axis: a plate
    turn: Optional[Turn] = None
    #: by direction: a `Face`, an sRGB colour, or None for a side that is not drawn. Other sides show the type's face of
    #: their direction, or the type's colour.
    looks: Mapping[str, Look] = _NOTHING
    #: by direction: left, top, right and bottom of the part of the texture, in sixteenths; default: as a full cube
    parts: Mapping[str, Tuple[float, ...]] = _NOTHING
    collides: bool = True  #: stops moving bodies


class Condition(NamedTuple):
    """A condition of a voxel's state, neighbours and position. Directions are those of the type before it is turned."""

    state_mask: int = 0  #: the bits of the state that are compared
    state: int = 0  #: their values
    connected: Tuple[str, ...] = ()  #: directions of sides with a connection
    unconnected: Tuple[str, ...] = ()  #: directions of sides without one
    #: of stairs: "straight", "outer_left", "outer_right", "inner_left" or "inner_right"; None: any
    corner: Optional[str] = None
    #: a share of all voxels, selected by their positions as if at random: count, first and end. A voxel has a number
    #: that depends only on its position; divided by count, the rest is at least first and less than end. None: all
    positions: Optional[Tuple[int, int, int]] = None


class ShapePart(NamedTuple):
    """A part of a type's shape. It is present if any of its conditions holds, and always if it has none."""

    elements: Tuple[Element, ...]
    orientation: int = 0  #: turns the part, before the state's orientation; see `turn_orientation`
    when: Tuple[Condition, ...] = ()


class Fluid(NamedTuple):
    """A fluid in the rest of a voxel that has a shape: the water around a fence. It is present if any of its conditions
    holds, and always if it has none; they may only use the state."""

    groups: int = 1  #: as `Shapes.groups` of the fluid: exactly one bit
    when: Tuple[Condition, ...] = ()


class Shapes(NamedTuple):
    """The shapes of a type, which a voxel's state and neighbours select."""

    parts: Tuple[ShapePart, ...] = ()
    #: "none"; "connected": fences, panes; "stairs", whose unturned high side is at +X; "fluid", which needs no parts:
    #: state bits 0 to 2 are the level, 0 for a source, and bit 3 means that it falls
    neighbours: str = "none"
    groups: int = 1  #: a bit per group: types with a common bit connect
    connects_to_full_sides: bool = True  #: also to sides of other types that are covered wholly
    fluid: Optional[Fluid] = None  #: in the rest of the voxel


class Orientations(NamedTuple):
    """The orientations that a type's state selects. They turn its faces and shapes."""

    #: orientations by the value of the state's bits, at most 48; or "about_y" (a furnace), "along_axes" (a log),
    #: "to_directions" (a torch at any face) or "about_y_and_upside_down" (stairs)
    by_value: Union[str, Tuple[int, ...]]
    first_bit: int = 0  #: the lowest bit of the state that selects
    front: str = "+X"  #: direction of the front before it is turned: the door of a furnace, the high side of stairs


def turn_orientation(orientation: int = 0, axis: int = 1, quarter_turns: int = 1) -> int:
    """Turns an orientation further about an axis (0 x, 1 y, 2 z), counter-clockwise seen from its positive end. Returns
    the number of the turned orientation. 0 turns nothing.

    >>> turn_orientation(turn_orientation(axis=0), axis=0, quarter_turns=3)
    0
    """
    out = ctypes.c_int32()
    _c.check(_c.lib.quoin_orientation_turn(_c.whole(orientation, "orientation"), _c.whole(axis, "axis"),
                                           _c.whole(quarter_turns, "quarter_turns"), ctypes.byref(out)))
    return out.value


def orientation_matrix(orientation: int) -> NdArray:
    """Returns the matrix of an orientation: int64, (3, 3), for column vectors. Raises ValueError unless it is 0 to 47.

    >>> orientation_matrix(turn_orientation(axis=1)).tolist()
    [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    """
    number = _c.whole(orientation, "orientation", 0, 47)
    rows = ((0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (2, 1, 0))[number // 8]
    signs = [-1 if number >> axis & 1 else 1 for axis in range(3)]
    matrix: NdArray = np.eye(3, dtype=np.int64)[list(rows)] * np.array(signs)[:, None]
    return matrix


class Textures:
    """The textures of a scene's types, numbered as layers of arrays: one array per size, and more if a size has more
    textures than a device's limit of layers. Later changes of the scene do not affect it.

    A texture's number is its layer + 65,536 * its array. `Scene.textures` makes the object.
    """

    def __init__(self, owner: _c.Owner) -> None:
        self._owner = owner

    @property
    def arrays(self) -> List[NdArray]:
        """A copy of all textures: for each array uint8, (layers, size, size, 4), sRGB with linear alpha.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> dark, light = np.full((16, 16, 3), 60, np.uint8), np.full((16, 16, 3), 200, np.uint8)
        >>> scene.set_faces(1, [Face(dark), Face(light), Face(dark)])
        >>> [one.shape for one in scene.textures().arrays]
        [(2, 16, 16, 4)]
        """
        count = ctypes.c_size_t()
        _c.check(_c.lib.quoin_textures_array_count(self._owner.handle, ctypes.byref(count)))
        return [self.level(i) for i in range(count.value)]

    def level(self, array: int, level: int = 0) -> NdArray:
        """Copies a mipmap level of an array: uint8, (layers, n, n, 4), where n is size >> level. Mipmaps are means in
        linear light, weighted by alpha. Raises QuoinError if there is no such array or level.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> scene.set_faces(1, Face(np.full((16, 16, 3), 90, np.uint8)))
        >>> scene.textures().level(0, 4).tolist()
        [[[[90, 90, 90, 255]]]]
        """
        array, level = _c.size(array, "array"), _c.whole(level, "level")
        found = _c.sized(_c.TextureArray)
        _c.check(_c.lib.quoin_textures_array_get(self._owner.handle, array, ctypes.byref(found)))
        size = found.texels >> min(max(level, 0), 31)
        out = np.empty((found.layers, size, size, 4), np.uint8)
        _c.check(_c.lib.quoin_textures_read(self._owner.handle, array, level, out.ctypes.data, out.size))
        return out

    def faces(self, type: int) -> Optional[Tuple[Face, ...]]:
        """Returns the faces of a type, in the order +X, -X, +Y, -Y, +Z, -Z; None if it has no textures. The images are
        read-only views of the library's memory, which stay valid without this object. Raises QuoinError if there is no
        such type."""
        found: Any = (_c.Face * 6)(_c.sized(_c.Face))
        count = ctypes.c_size_t()
        _c.check(_c.lib.quoin_textures_faces(self._owner.handle, _c.size(type, "type"), found, ctypes.byref(count)))
        return tuple(_face_of(one, self._owner) for one in found) if count.value else None

    def shapes(self, type: int) -> Optional[Shapes]:
        """Returns the shapes of a type; None if it is a cube. Images of looks are read-only views, as in `faces`.
        Raises QuoinError if there is no such type.

        >>> scene = from_numpy(np.ones((2, 2, 2), np.uint8), [(255, 0, 0)])
        >>> scene.set_shapes(1, [Element(max=(16, 8, 16), looks={"+Y": (90, 160, 70)})])
        >>> scene.textures().shapes(1).parts[0].elements[0].max
        (16.0, 8.0, 16.0)
        """
        number = _c.size(type, "type")
        whole = _c.sized(_c.Shapes)
        _c.check(_c.lib.quoin_textures_shapes(self._owner.handle, number, ctypes.byref(whole)))
        if not whole.part_count and not whole.neighbours:
            return None
        parts, elements, conditions, looks = (_room(*one) for one in (
            (_c.ShapePart, whole.part_count), (_c.ShapeElement, whole.element_count),
            (_c.ShapeCondition, whole.condition_count), (_c.Face, whole.look_count)))
        _c.check(_c.lib.quoin_textures_read_shapes(self._owner.handle, number, parts or None, elements or None,
                                                   conditions or None, looks or None))
        seen = [_look_of(one, self._owner) for one in looks]
        boxes, rules = iter([_element_of(one, seen) for one in elements]), iter(map(_condition_of, conditions))
        made = tuple(ShapePart(tuple(next(boxes) for _ in range(one.element_count)), one.orientation,
                               tuple(next(rules) for _ in range(one.condition_count))) for one in parts)
        return Shapes(made, _NEIGHBOURS[whole.neighbours], whole.groups, not whole.ignores_full_sides,
                      Fluid(whole.fluid_groups, tuple(rules)) if whole.fluid_groups else None)


def _room(structure: Any, count: int) -> Any:
    """Returns an array of structs."""
    return (structure * count)(*(_c.sized(structure) for _ in range(count)))


def _face_of(one: Any, owner: _c.Owner) -> Face:
    image = _c.view_of(owner, one.rgba, (one.texels, one.texels, 4), np.dtype(np.uint8)) if one.rgba else None
    return Face(image, _c.text_of(one.name), one.turn, bool(one.mirrored), tuple(one.tint)[:3], _ALPHAS[one.alpha],
                one.texture if one.texture != _c.NO_TEXTURE else None, one.emission_share)


def _look_of(one: Any, owner: _c.Owner) -> Look:
    return _face_of(one, owner) if one.rgba or one.has_emission_share else tuple(one.tint)[:3]


def faces_struct(faces: Union[Face, Sequence[Face]]) -> Any:
    """Converts one face, (sides, top, bottom), or six faces to an array of quoin_face."""
    given = [faces] if isinstance(faces, Face) else list(faces)
    if not all(isinstance(one, Face) for one in given):
        raise TypeError("faces must be quoin.Face objects")
    if len(given) == 1:
        given *= 6
    elif len(given) == 3:
        sides, top, bottom = given
        given = [sides, sides, top, bottom, sides, sides]
    if len(given) != 6:
        raise ValueError(f"there must be 1, 3 or 6 faces, not {len(given)}")
    structs: Any = (_c.Face * 6)()
    structs.kept = [_fill_image(struct, face) for struct, face in zip(structs, given)]  # keeps the images alive
    for struct, face in zip(structs, given):
        _fill(struct, face)
    return structs


def _fill_image(struct: Any, face: Face) -> NdArray:
    image = face.image
    if not isinstance(image, np.ndarray):
        raise TypeError("the image of a face must be a NumPy array")
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[0] != image.shape[1] or image.shape[2] not in (3, 4):
        raise ValueError("the image of a face must be uint8, (size, size, 3) or (size, size, 4)")
    if image.shape[2] == 3:
        image = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    image = np.ascontiguousarray(image)
    struct.rgba, struct.texels = image.ctypes.data, image.shape[0]
    return image


def _fill(struct: Any, face: Face) -> None:
    if face.alpha not in _ALPHAS:
        raise ValueError(f"alpha must be one of {', '.join(_ALPHAS)}, not {face.alpha!r}")
    tint = [_c.whole(v, "a tint", 0, 255) for v in face.tint]
    if len(tint) not in (3, 4):
        raise ValueError("a tint must be three or four numbers")
    struct.size = ctypes.sizeof(_c.Face)
    struct.name = _c.bytes_of(face.name)
    struct.turn, struct.mirrored = _c.whole(face.turn, "turn"), int(face.mirrored)
    struct.alpha = _ALPHAS.index(face.alpha)
    struct.has_tint, struct.tint[:] = 1, (tint + [255])[:4]
    struct.has_emission_share, struct.emission_share = 1, _c.whole(face.emission_share, "emission_share", 0, 255)


def _number_of(name: Any, names: Sequence[Any], label: str) -> int:
    if name not in names:
        raise ValueError(f"{label} must be one of {', '.join(map(str, names))}, not {name!r}")
    return names.index(name)


def _bits_of(directions: Any) -> int:
    return sum(1 << number for number in {_number_of(one, DIRECTIONS, "a direction") for one in directions})


def _directions_of(bits: int) -> Tuple[str, ...]:
    return tuple(name for number, name in enumerate(DIRECTIONS) if bits >> number & 1)


def _element_of(one: Any, seen: Sequence[Look]) -> Element:
    looks: Dict[str, Look] = {name: None if look < 0 else seen[look - 1]
                              for name, look in zip(DIRECTIONS, one.looks) if look}
    turn = Turn(one.turn_degrees, one.turn_axis, tuple(one.turn_origin), bool(one.turn_rescales))
    parts = {name: tuple(one.parts[number]) for number, name in enumerate(DIRECTIONS) if one.has_parts >> number & 1}
    return Element(tuple(one.min), tuple(one.max), turn if one.has_turn else None, looks, parts, not one.passable)


def _condition_of(one: Any) -> Condition:
    share = (one.position_count, one.position_first, one.position_end)
    return Condition(one.state_mask, one.state, _directions_of(one.connected), _directions_of(one.unconnected),
                     _CORNERS[one.corner], share if one.position_count else None)


class _Looks:
    """The looks of a type's shapes, each once."""

    def __init__(self) -> None:
        self._numbers: Dict[Any, int] = {}
        self.all: List[Any] = []
        self.kept: List[Any] = []  # images

    def number_of(self, look: Any) -> int:
        if look is None:
            return -1
        key: Any = tuple(look)
        if isinstance(look, Face):
            key = (id(look.image), *look[1:4], tuple(look.tint), look.alpha, look.emission_share)
        if key not in self._numbers:
            struct = _c.sized(_c.Face)
            if isinstance(look, Face):
                if look.image is not None:
                    self.kept += [look.image, _fill_image(struct, look)]
                _fill(struct, look)
            else:
                colour = [_c.whole(v, "a colour", 0, 255) for v in look]
                if len(colour) not in (3, 4):
                    raise ValueError("a look must be a quoin.Face, a colour of three numbers, or None")
                struct.has_tint, struct.tint[:] = 1, (colour + [255])[:4]
            self.all.append(struct)
            self._numbers[key] = len(self.all)
        return self._numbers[key]


def _fill_element(struct: Any, one: Any, looks: _Looks) -> None:
    if not isinstance(one, Element):
        raise TypeError("elements must be quoin.Element objects")
    struct.min[:], struct.max[:] = _c.three(one.min, "min"), _c.three(one.max, "max")
    if one.turn is not None:
        struct.has_turn, struct.turn_degrees = 1, _c.number(one.turn.degrees, "degrees")
        struct.turn_axis, struct.turn_rescales = _c.whole(one.turn.axis, "axis"), int(one.turn.rescales)
        struct.turn_origin[:] = _c.three(one.turn.origin, "origin")
    struct.passable = int(not one.collides)
    for name, look in one.looks.items():
        struct.looks[_number_of(name, DIRECTIONS, "a direction")] = looks.number_of(look)
    for name, part in one.parts.items():
        number = _number_of(name, DIRECTIONS, "a direction")
        if len(part) != 4:
            raise ValueError("a part must be four numbers: left, top, right, bottom")
        struct.has_parts |= 1 << number
        struct.parts[number][:] = [_c.number(v, "a part") for v in part]


def _fill_condition(struct: Any, one: Any) -> None:
    if not isinstance(one, Condition):
        raise TypeError("conditions must be quoin.Condition objects")
    struct.state_mask = _c.whole(one.state_mask, "state_mask", 0, 2**32 - 1)
    struct.state = _c.whole(one.state, "state", 0, 2**32 - 1)
    struct.connected, struct.unconnected = _bits_of(one.connected), _bits_of(one.unconnected)
    struct.corner = _number_of(one.corner, _CORNERS, "corner")
    if one.positions is None:
        return
    if len(one.positions) != 3 or not one.positions[0]:
        raise ValueError("positions must be three numbers: a count from 1 to 4096, first and end")
    struct.position_count, struct.position_first, struct.position_end = (
        _c.whole(number, "a number of positions", 0, 4096) for number in one.positions)


def shapes_struct(shapes: Any) -> Any:
    """Converts `Shapes`, an element or several elements to a quoin_shapes."""
    if isinstance(shapes, Element):
        shapes = [shapes]
    if not isinstance(shapes, Shapes):
        shapes = Shapes((ShapePart(tuple(shapes)),))
    if not all(isinstance(part, ShapePart) for part in shapes.parts):
        raise TypeError("parts must be quoin.ShapePart objects")
    elements = [one for part in shapes.parts for one in part.elements]
    conditions = [one for part in shapes.parts for one in part.when]
    fluid = shapes.fluid
    if fluid is not None:
        if not isinstance(fluid, Fluid):
            raise TypeError("the fluid must be a quoin.Fluid")
        conditions.extend(fluid.when)
    parts, boxes, rules = (_room(*one) for one in ((_c.ShapePart, len(shapes.parts)),
                                                    (_c.ShapeElement, len(elements)),
                                                    (_c.ShapeCondition, len(conditions))))
    for struct, part in zip(parts, shapes.parts):
        struct.element_count, struct.condition_count = len(part.elements), len(part.when)
        struct.orientation = _c.whole(part.orientation, "orientation")
    looks = _Looks()
    for struct, one in zip(boxes, elements):
        _fill_element(struct, one, looks)
    for struct, one in zip(rules, conditions):
        _fill_condition(struct, one)
    faces = (_c.Face * len(looks.all))(*looks.all)
    given = _c.sized(_c.Shapes)
    for name, count, structs in (("part", len(shapes.parts), parts), ("element", len(elements), boxes),
                                 ("condition", len(conditions), rules), ("look", len(looks.all), faces)):
        setattr(given, name + "s", ctypes.addressof(structs) if count else None)
        setattr(given, name + "_count", count)
    given.neighbours = _number_of(shapes.neighbours, _NEIGHBOURS, "neighbours")
    given.groups = _c.whole(shapes.groups, "groups", 0, 2**32 - 1)
    given.ignores_full_sides = int(not shapes.connects_to_full_sides)
    if fluid is not None:
        given.fluid_groups = _c.whole(fluid.groups, "groups of the fluid", 1, 2**32 - 1)
        given.fluid_condition_count = len(fluid.when)
    given.kept = (parts, boxes, rules, faces, looks.kept)  # keeps them alive during the call
    return given


def orientations_struct(orientations: Union[Orientations, str]) -> Any:
    """Converts orientations, or the name of a list of them, to a quoin_orientations."""
    one = Orientations(orientations) if isinstance(orientations, str) else orientations
    if not isinstance(one, Orientations):
        raise TypeError("orientations must be a quoin.Orientations or a name")
    given = _c.sized(_c.Orientations)
    given.first_bit = _c.whole(one.first_bit, "first_bit")
    given.front = _number_of(one.front, DIRECTIONS, "front")
    if isinstance(one.by_value, str):
        given.kind = _number_of(one.by_value, _KINDS[1:], "by_value") + 1
        return given
    numbers = [_c.whole(v, "an orientation", 0, 255) for v in one.by_value]
    if len(numbers) > 48:
        raise ValueError("there can be at most 48 orientations")
    given.count, given.by_value[:len(numbers)] = len(numbers), numbers
    return given
