"""Textures of voxel types."""

from __future__ import annotations

import ctypes
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _c
from ._c import NdArray

_ALPHAS = ("opaque", "cutout", "translucent")


class Face(NamedTuple):
    """One face of a voxel type: a texture that covers the face of a voxel once.

    Turn 0 shows the texture to a viewer outside like this: on the four sides, its top is at +Y; on +Y its right is at
    +Z and its top at +X; on -Y its right is at +X and its top at +Z.
    """

    image: NdArray  #: uint8, (size, size, 4) or (size, size, 3), rows from the top: sRGB with linear alpha
    name: str = ""  #: of the texture
    turn: int = 0  #: clockwise quarter turns for a viewer outside, 0 to 3
    mirrored: bool = False  #: exchanges left and right, before the turn
    tint: Tuple[int, ...] = (255, 255, 255)  #: sRGB; multiplies the texture in linear light
    alpha: str = "opaque"  #: "opaque", "cutout" (texels are visible or not) or "translucent"
    texture: Optional[int] = None  #: result of `Textures.faces`: the number in `Mesh.textures`


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


def _face_of(one: Any, owner: _c.Owner) -> Face:
    image = _c.view_of(owner, one.rgba, (one.texels, one.texels, 4), np.dtype(np.uint8))
    assert image is not None
    return Face(image, _c.text_of(one.name), one.turn, bool(one.mirrored), tuple(one.tint)[:3], _ALPHAS[one.alpha],
                one.texture if one.texture != _c.NO_TEXTURE else None)


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
    structs.kept = [_fill(struct, face) for struct, face in zip(structs, given)]  # keeps the images alive
    return structs


def _fill(struct: Any, face: Face) -> NdArray:
    image = face.image
    if not isinstance(image, np.ndarray):
        raise TypeError("the image of a face must be a NumPy array")
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[0] != image.shape[1] or image.shape[2] not in (3, 4):
        raise ValueError("the image of a face must be uint8, (size, size, 3) or (size, size, 4)")
    if image.shape[2] == 3:
        image = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    image = np.ascontiguousarray(image)
    if face.alpha not in _ALPHAS:
        raise ValueError(f"alpha must be one of {', '.join(_ALPHAS)}, not {face.alpha!r}")
    tint = [_c.whole(v, "a tint", 0, 255) for v in face.tint]
    if len(tint) not in (3, 4):
        raise ValueError("a tint must be three or four numbers")
    struct.size = ctypes.sizeof(_c.Face)
    struct.name = _c.bytes_of(face.name)
    struct.rgba, struct.texels = image.ctypes.data, image.shape[0]
    struct.turn, struct.mirrored = _c.whole(face.turn, "turn"), int(face.mirrored)
    struct.alpha = _ALPHAS.index(face.alpha)
    struct.has_tint, struct.tint[:] = 1, (tint + [255])[:4]
    return image
