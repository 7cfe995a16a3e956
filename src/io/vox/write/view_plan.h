#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/io/loaded_scene.h>

#include "io/vox/chunks.h"
#include "io/vox/vox_reader.h"
#include "io/vox/write/node_content.h"

namespace quoin::vox {

/// The changes to cameras and sun relative to the source.
struct ViewPlan {
  std::map<std::int32_t, FileCamera> cameras;  ///< new and changed cameras, by number
  std::vector<std::int32_t> order;             ///< their numbers, in the scene's order
  std::vector<std::int32_t> removed;           ///< numbers of removed source cameras
  std::optional<Sun> sun;
  bool has_more_settings = false;  ///< there are settings other than the sun's, which are not written
};

/// Compares a loaded scene with its source. The initial camera gets a free number, if it is none of the others.
[[nodiscard]] ViewPlan plan_view(const LoadedScene& loaded, const VoxSource& source, bool is_new);

/// Sets the keys of an rCAM chunk so that `cameras_of` returns the same camera, except for an orthographic camera that
/// is not in front of the whole scene. Other keys stay.
///
/// Without a focus the radius is 0.
void set_camera_keys(const FileCamera& camera, Entries& keys);

/// Sets the keys of an rOBJ chunk of `_type` `_inf` so that `render_settings_of` returns the sun. Other keys stay. The
/// colour becomes bytes; brightness above white goes into `_i`.
void set_sun_keys(const Sun& sun, Entries& keys);

/// Returns the number of an rCAM chunk; nullopt for other chunks.
[[nodiscard]] std::optional<std::int32_t> camera_number(std::string_view id, std::span<const std::byte> content);
/// Returns true if a chunk is an rOBJ of the sun.
[[nodiscard]] bool is_sun(std::string_view id, std::span<const std::byte> content);

}  // namespace quoin::vox
