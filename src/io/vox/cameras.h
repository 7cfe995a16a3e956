#pragma once

#include <string>
#include <vector>

#include <quoin/io/vox.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

/// The cameras of the file that were set, in its order, in Quoin's axes. MagicaVoxel writes ten, of which those that
/// nobody set look from the origin along the front.
///
///   _focus   what the camera looks at, in voxels      _mode   pers, free; orth, iso; pano
///   _angle   pitch, yaw and roll in degrees           _fov    vertical, in degrees
///   _radius  from the focus to the camera             _frustum tan(fov / 2)
///
/// At 0, 0, 0 it looks along +y; pitch turns it up, yaw to the left, roll the picture to the left. An orthographic
/// camera shows of the focus what a perspective one would, and stands before all of `bounds`.
/// What cannot be read or drawn is skipped, with a warning.
/// Source: how github.com/AstrorEnales/blender_magicavoxel (blender_magicavoxel.py) and github.com/vengi-voxel/vengi
///         (MagicaVoxel.cpp) place them, which agree; the format's description names the keys only.
[[nodiscard]] std::vector<FileCamera> cameras_of(const Document& document, const DBox& bounds,
                                                 std::vector<std::string>& warnings);

}  // namespace quoin::vox
