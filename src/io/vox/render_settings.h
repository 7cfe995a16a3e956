#pragma once

#include <optional>

#include <quoin/io/loaded_scene.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

/// Converts the file's render settings to Quoin's; nullopt for a file without any.
///
///   _bounce  _diffuse, _specular: the larger, and direct light; _scatter
///   _env     _mode: 0 _uni, 1 _atm, 2 _ibl
///   _inf     the sun: _i, _k, _angle (pitch above the horizon; yaw, as cameras that look from there), _area
///            (tangent of half its disc), _disk (1: it is visible)
///   _uni     the sky: _i, _k                         _atm  _ray_, _mie_, _o3_: _d (0.4 is the Earth's), _k; _mie_g
///   _ibl     _path, _i, _rot or _angle (its yaw)     _fog_uni  _d (per voxel), _k, _g
///   _lens    _aperture (radius in voxels), _blade_n, _blade_r (degrees)
///   _film    _expo, _vig, _aces, _gam                _bloom    _mix, _scale, _aspect, _threshold
///   _ground  _color, _hor                            _bg       _color
///   _setting _ground, _bg_c, _bg_a: 1 if these are drawn; or _enable of the group, in older files
///
/// FileRenderSettings::not_drawn lists the other keys with a value other than MagicaVoxel's default, and invalid
/// values. Colours are sRGB; numbers out of range are clamped.
/// Source: no documentation by MagicaVoxel; names and defaults are from its files, units from its images. See
/// docs/decisions/archive/098.
[[nodiscard]] std::optional<FileRenderSettings> render_settings_of(const Document& document);

}  // namespace quoin::vox
