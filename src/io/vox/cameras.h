#pragma once

#include <string>
#include <vector>

#include <quoin/io/vox.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

/// Returns the file's cameras that were set, in order, in Quoin's axes. MagicaVoxel writes ten; unused ones look from
/// the origin along the front.
///
///   _focus   look-at point, in voxels                 _mode   pers, free; orth, iso; pano
///   _angle   pitch, yaw and roll in degrees           _fov    vertical, in degrees
///   _radius  from the focus to the camera             _frustum tan(fov / 2)
///
/// At 0, 0, 0 it looks along +y; pitch turns it up, yaw to the left, roll rotates the image to the left. An
/// orthographic camera shows the same extent at the focus as a perspective one, and lies in front of all of `bounds`.
/// Skips invalid or unsupported cameras, with a warning.
/// Source: github.com/AstrorEnales/blender_magicavoxel (blender_magicavoxel.py) and github.com/vengi-voxel/vengi
/// (MagicaVoxel.cpp), which agree on the placement; the format's description lists only the key names.
[[nodiscard]] std::vector<FileCamera> cameras_of(const Document& document, const DBox& bounds,
                                                 std::vector<std::string>& warnings);

}  // namespace quoin::vox
