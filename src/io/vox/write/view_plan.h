#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/io/loaded_scene.h>

#include "io/vox/source.h"
#include "io/vox/write/chunk_writer.h"
#include "io/vox/write/node_content.h"

namespace quoin::vox {

/// What of cameras and sun is other than in the source.
struct ViewPlan {
  std::map<std::int32_t, FileCamera> cameras;  ///< by number: new ones, and those that changed
  std::vector<std::int32_t> order;             ///< their numbers, as the scene has them
  std::vector<std::int32_t> removed;           ///< numbers that the source has
  std::optional<Look> sun;
  bool has_more_settings = false;  ///< those of the sun alone are written, and there are others
};

/// Compares what was loaded with its source. The camera to look through at first, where it is none of the others, gets
/// a number that is free.
[[nodiscard]] ViewPlan plan_view(const LoadedScene& loaded, const VoxSource& source, bool is_new);

/// Sets the keys of an rCAM chunk so that `cameras_of` gives the camera back, but for an orthographic one that does not
/// stand before all of the scene. Other keys stay.
///
/// A focus that is not said is a radius of 0.
void set_camera_keys(const FileCamera& camera, Entries& keys);

/// Sets the keys of an rOBJ chunk of `_type` `_inf` so that `look_of` gives the look's sun back. Other keys stay. The
/// colour becomes bytes; what is brighter than white goes into `_i`.
void set_sun_keys(const Look& look, Entries& keys);

/// The number of an rCAM chunk; nothing of another chunk.
[[nodiscard]] std::optional<std::int32_t> camera_number(std::string_view id, std::span<const std::byte> content);
/// Whether a chunk is an rOBJ of the sun.
[[nodiscard]] bool is_sun(std::string_view id, std::span<const std::byte> content);

}  // namespace quoin::vox
