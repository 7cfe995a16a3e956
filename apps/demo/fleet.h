#pragma once

#include <quoin/io/vox.h>
#include <quoin/render/cpu_renderer.h>

namespace demo {

/// A fleet of voxel ships over a generated terrain, with a camera and a sun.
[[nodiscard]] quoin::Result<quoin::LoadedScene> make_fleet();

/// Returns the render options of the fleet, with its own sun.
[[nodiscard]] quoin::RenderOptions fleet_options(const quoin::LoadedScene& fleet);

}  // namespace demo
