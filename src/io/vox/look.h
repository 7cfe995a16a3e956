#pragma once

#include <optional>

#include <quoin/scene/look.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

/// What the render settings of the file mean in Quoin's terms; nothing of a file without any.
///
///   _bounce  _diffuse, _specular: the larger, and direct light; _scatter
///   _env     _mode: 0 _uni, 1 _atm, 2 _ibl
///   _inf     the sun: _i, _k, _angle (pitch above the horizon; yaw, as cameras that look from there), _area (tangent
///            of half its disc), _disk (whether that is seen)
///   _uni     the sky: _i, _k                         _atm  _ray_, _mie_, _o3_: _d (0.4 is the Earth's), _k; _mie_g
///   _ibl     _path, _i, _rot or _angle (its yaw)     _fog_uni  _d (a voxel), _k, _g
///   _lens    _aperture (radius in voxels), _blade_n, _blade_r (degrees)
///   _film    _expo, _vig, _aces, _gam                _bloom    _mix, _scale, _aspect, _threshold
///   _ground  _color, _hor                            _bg       _color
///   _setting _ground, _bg_c, _bg_a: whether these are drawn; or _enable of the group, in older files
///
/// What else is set, unless to what MagicaVoxel sets it when nobody does, and what cannot be read, is named in
/// FileLook::not_drawn. Colours are sRGB; numbers out of range count as the nearest within.
/// Source: none of MagicaVoxel's; names and usual values as its files have them, units as its pictures look. See
///         docs/decisions/archive/098.
[[nodiscard]] std::optional<FileLook> look_of(const Document& document);

}  // namespace quoin::vox
