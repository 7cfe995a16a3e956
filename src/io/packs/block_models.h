#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <quoin/core/direction.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_shape.h>

#include "io/packs/pack_files.h"

// Models of resource packs: JSON files with parents, textures and boxes.
// Source: the Minecraft Wiki, "Model" (https://minecraft.wiki/w/Model).

namespace quoin::packs {

/// Maximum number of elements of a model. A type's shapes have at most as many.
inline constexpr std::size_t kMaxModelElements = 4 * kMaxShapeElements;
/// Maximum number of a model's parents.
inline constexpr int kMaxModelParents = 32;

/// Reads and parses a JSON file of a pack; comments are allowed. Returns nullopt if the pack does not have it.
/// Errors: those of PackFiles::read; BadFormat, also for more than 64 levels of brackets. They name the file.
[[nodiscard]] Result<std::optional<nlohmann::json>> read_pack_json(const PackFiles& pack, const std::string& path);

/// A face of a model's element.
struct PackFace {
  std::string texture;                       ///< a name, or a reference to a texture of the model: "#side"
  std::optional<std::array<float, 4>> uv{};  ///< left, top, right, bottom, in sixteenths; nullopt: by the box
  int turn = 0;                              ///< clockwise quarter turns of the texture, 0 to 3
  bool is_tinted = false;
  std::uint8_t emission_share = 255;  ///< VoxelFace::emission_share
};

/// A box of a model, in the published axes, which are those of grids: east is +X, up +Y, south +Z.
struct PackElement {
  Vec3 from{0.0F};  ///< in sixteenths
  Vec3 to{16.0F};
  std::optional<ElementTurn> turn{};
  std::array<std::optional<PackFace>, 6> faces{};  ///< by Direction
  int light_emission = 0;  ///< the least light level in which the game shows the element, 0 to 15
};

/// A model with the content of its parents.
struct BlockModel {
  std::map<std::string, std::string, std::less<>> textures{};  ///< by name without '#'
  /// The elements of the model, or of its nearest parent with some; shared with it. Null: none lists elements.
  std::shared_ptr<const std::vector<PackElement>> shared_elements{};
  int parents = 0;  ///< number of parents

  /// Returns the elements; none if no model lists them.
  [[nodiscard]] std::span<const PackElement> elements() const {
    return shared_elements == nullptr ? std::span<const PackElement>() : std::span(*shared_elements);
  }

  /// Returns the texture that a face's text names, after all references; nullopt if there is none.
  [[nodiscard]] std::optional<ResourceName> texture(std::string_view text) const;
};

/// Reads models by name, each once. Threads: one at a time. Lifetime: the pack.
class ModelReader {
 public:
  explicit ModelReader(const PackFiles& pack) : pack_(pack) {}

  /// Returns a model with its parents' content; null if the pack does not have it. Names without a folder lie in
  /// `block`, as before 1.13.
  ///
  /// Errors: BadFormat, with the file, for JSON of another form, numbers that are not finite or outside their range,
  ///         missing parents and cycles of parents; LimitExceeded for sizes and numbers of elements and parents.
  [[nodiscard]] Result<std::shared_ptr<const BlockModel>> model(std::string_view name);

 private:
  using Known = Result<std::shared_ptr<const BlockModel>>;
  struct Link;
  [[nodiscard]] Known read(const ResourceName& name);
  [[nodiscard]] Known made(const Link& link, const Known& parent) const;

  const PackFiles& pack_;
  std::map<std::string, Known> known_;
};

}  // namespace quoin::packs
