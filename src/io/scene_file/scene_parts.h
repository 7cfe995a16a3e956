#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <quoin/io/loaded_scene.h>
#include <quoin/io/scene_file.h>

#include "io/scene_file/json_reader.h"

// The parts of a scene, except its voxels, as the JSON of scene files (docs/scene-files.md). Worlds on disk store the
// same text per part.

namespace quoin {

/// Returns true if the bytes look like the start of a scene file: a JSON object with its version near the beginning.
[[nodiscard]] bool is_scene_file(std::span<const std::byte> beginning);

}  // namespace quoin

namespace quoin::scene_json {

/// Keeps keys in insertion order.
using OrderedJson = nlohmann::ordered_json;

/// Returns a vector as a list of numbers.
[[nodiscard]] inline OrderedJson triple(const DVec3& v) {
  return {v.x, v.y, v.z};
}
[[nodiscard]] inline OrderedJson triple(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// Returns true for equal bits: -0 differs from 0.
[[nodiscard]] bool is_same(double a, double b);

/// Writes parts, and records if they need version 2 of the format.
class PartWriter {
 public:
  /// Writes the next type, counted from 1. A texture of a type that this object wrote before is a reference to it.
  [[nodiscard]] OrderedJson json_of(const VoxelProperties& type);
  /// Writes a grid without its voxels, densities and data.
  [[nodiscard]] OrderedJson json_of(const SceneGrid& grid);
  [[nodiscard]] OrderedJson json_of(const SceneFile::Placement& placement);
  [[nodiscard]] OrderedJson json_of(const SceneFile::Group& entry);
  [[nodiscard]] OrderedJson json_of(const SceneLayer& layer);
  [[nodiscard]] OrderedJson json_of(const Lamp& lamp);
  [[nodiscard]] OrderedJson json_of(const Camera& camera);
  /// Writes the settings that differ from Environment::natural().
  [[nodiscard]] OrderedJson json_of(const Environment& environment);

  [[nodiscard]] bool needs_second() const { return needs_second_; }

 private:
  struct WrittenTexture {
    Texture texture;
    std::size_t type = 0;
    std::size_t index = 0;  // in the type's list
  };

  // The textures of the type that is written: those of its faces, then those of its shapes.
  using TypeTextures = std::vector<Texture>;

  [[nodiscard]] OrderedJson json_of(const VoxelFaces& faces, TypeTextures& textures);
  [[nodiscard]] OrderedJson json_of(const VoxelShapes& shapes, TypeTextures& textures);
  [[nodiscard]] OrderedJson json_of(const ShapeElement& element, TypeTextures& textures, OrderedJson& list);
  [[nodiscard]] OrderedJson json_of(const VoxelFace& face, TypeTextures& textures, OrderedJson& list);
  [[nodiscard]] OrderedJson json_of(const Texture& texture, std::size_t index);
  [[nodiscard]] OrderedJson text(const std::string& bytes);

  std::size_t types_ = 0;                                 // that were written
  std::multimap<std::uint64_t, WrittenTexture> written_;  // of all types, each once, by hash
  bool needs_second_ = false;
};

/// The textures of the types that were read, as their texts list them: of type i + 1 at index i.
using TexturesOfTypes = std::vector<std::vector<Texture>>;

// Reads parts; appends errors to `faults`.

/// Reads the next type, whose textures may refer to those of `earlier` types, and appends its textures to `earlier`.
[[nodiscard]] VoxelProperties properties_of(const Json& json, const Place& place, TexturesOfTypes& earlier,
                                            Faults& faults);
[[nodiscard]] SceneFile::Placement placement_of(const Json& json, const Place& place, Faults& faults);
[[nodiscard]] SceneFile::Group group_of(const Json& json, const Place& place, Faults& faults);
[[nodiscard]] SceneLayer layer_of(const Json& json, const Place& place, Faults& faults);
[[nodiscard]] Lamp lamp_of(const Json& json, const Place& place, Faults& faults);
[[nodiscard]] Camera camera_of(const Json& json, const Place& place, Faults& faults);
[[nodiscard]] Environment environment_from(const Json& json, const Place& place, Faults& faults);

using SkyReader = Result<RadianceImage> (*)(const std::filesystem::path& path);

/// Sets the reader that `read_sky_image` uses. Returns true. The library of formats calls it before main; programs that
/// link only the core library have no reader.
bool register_sky_reader(SkyReader reader);

/// Reads the sky's image, which a scene file or world names relative to itself. `from`: the path of this file; empty:
/// it was read from bytes. Returns a warning, or "" if the image was read, or the sky or LoadOptions::sky_image needs
/// none.
[[nodiscard]] std::string read_sky_image(const std::filesystem::path& from, const LoadOptions& options, Sky& sky);

/// Reads name, pivot and canvas.
void read_grid_header(const Object& object, SceneGrid& grid);
/// Reads the density band that a field is clamped to, if the key is present.
void read_band(const Object& object, SceneGrid& grid);

}  // namespace quoin::scene_json
