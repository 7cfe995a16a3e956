#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/io/scene_file.h>
#include <quoin/store/world_store.h>

#include "store/database/schema.h"

// Parts of a world as JSON texts, in the form of scene files (docs/scene-files.md). Part numbers replace the list
// indices of scene files.

namespace quoin::store {

[[nodiscard]] std::string text_of(const VoxelProperties& type);
/// Returns the bytes of a type's textures in its text, without making the text.
[[nodiscard]] std::uint64_t texture_bytes(const VoxelProperties& type);
/// Returns name, pivot and canvas as in scene files, `band`, and `whole` if it is true.
[[nodiscard]] std::string text_of(const WorldGrid& grid);
[[nodiscard]] std::string text_of(const SceneFile::Placement& instance);
[[nodiscard]] std::string text_of(const SceneFile::Group& group);
[[nodiscard]] std::string text_of(const SceneLayer& layer);
[[nodiscard]] std::string text_of(const Lamp& lamp);
[[nodiscard]] std::string text_of(const Environment& environment);
[[nodiscard]] std::string text_of(const Camera& camera);
/// Returns a camera, with `number` and `focus_distance`.
[[nodiscard]] std::string text_of(const FileCamera& camera);
/// Returns a list of three numbers.
[[nodiscard]] std::string text_of(DVec3 vector);

/// Returns true if `check_part` accepts the text of the part: its numbers are finite, its scale is positive, and its
/// name has at most 1 MiB, far below the limit of a part. Cost: O(1).
[[nodiscard]] bool is_readable(const SceneFile::Placement& instance);
[[nodiscard]] bool is_readable(const SceneFile::Group& group);
/// The part of `is_readable` that concerns a name.
[[nodiscard]] bool is_readable_name(std::string_view name);

/// Reads a part. `name`: its name for error messages. Errors: BadFormat.
template <class T>
[[nodiscard]] Result<T> part_from(std::span<const std::byte> text, const std::string& name);

/// Checks that parts of the kind can have the number. Errors: InvalidArgument.
[[nodiscard]] Status check_number(const PartKey& key);
/// Checks that parts of the kind can have the number, and that a scene part can be read again. Parts of other kinds may
/// have any content.
/// Errors: InvalidArgument.
[[nodiscard]] Status check_part(const PartKey& key, std::span<const std::byte> body);

}  // namespace quoin::store
