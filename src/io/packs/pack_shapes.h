#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/function_ref.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_shape.h>

#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/families.h"
#include "io/packs/pack_textures.h"

// Models of resource packs as elements of shapes, or as the faces of cubes.

namespace quoin::packs {

/// Returns the orientation of a model in a block state.
[[nodiscard]] AxisOrientation orientation_of(const StateModel& state);

/// Returns the element that a model shows when it is turned and its textures keep their place in the world (`uvlock`).
/// Its faces have parts (PackFace::uv). Requires: the turn is a rotation.
[[nodiscard]] PackElement turned_with_world(const PackElement& element, const AxisOrientation& turn);

/// The faces of a block's models that have its emission. A face must meet all conditions.
struct EmittingFaces {
  enum class Elements : std::uint8_t { All, Boxes, Plates };

  std::vector<std::string> textures{};  ///< patterns of names without folders (match_name); empty: all
  Elements elements = Elements::All;    ///< boxes, or plates without thickness
  /// Lower and upper corner of the space whose faces count, in sixteenths before turns. Elements that reach outside are
  /// cut.
  std::optional<std::array<Vec3, 2>> within{};
  std::uint8_t share = 255;  ///< VoxelFace::emission_share of these faces; others have 0
};

/// The rules for all blocks: data/emission.json. Immutable after it was made.
class EmissionRules {
 public:
  /// Parses the table: a list of [names, conditions]. docs/formats/block_pack.md describes it.
  ///
  /// Errors: BadFormat, naming the row, for invalid JSON and unknown conditions.
  [[nodiscard]] static Result<EmissionRules> from_text(std::string_view table);
  /// Returns the rules of the library's table, which is parsed at the first call.
  [[nodiscard]] static const EmissionRules& instance();

  /// Returns the rule of a block; null: all its faces emit. `name`: without a namespace.
  [[nodiscard]] const EmittingFaces* find(std::string_view name) const;

 private:
  NamePatterns names_;
  std::vector<EmittingFaces> rows_;
};

/// Returns the elements of a model with the shares of emission of a rule.
[[nodiscard]] std::vector<PackElement> with_emission(const BlockModel& model, const EmittingFaces& rule);
/// Returns the elements with the shares of a type's emission that give PackElement::light_emission.
/// `emission`: VoxelProperties::emission, greater than 0.
[[nodiscard]] std::vector<PackElement> with_light_emission(std::span<const PackElement> elements, float emission);

/// The looks of a type's faces.
struct FaceColours {
  /// Returns the texture of a face; null for a face of the plain colour.
  FunctionRef<const PackTexture*(const BlockModel& model, const PackFace& face)> texture;
  Rgba8 plain{};              ///< of faces without a texture
  Rgba8 tint{255, 255, 255};  ///< of tinted faces
};

/// Returns the elements of a model. Faces that lie on equal faces of earlier elements are blended with these, such as
/// the grass at the sides of earth. `textures`: makes blended textures, and those of plain faces if `has_textures`;
/// else such faces have no texture and the plain colour.
[[nodiscard]] std::vector<ShapeElement> elements_of(const BlockModel& model, std::span<const PackElement> elements,
                                                    const FaceColours& colours, bool has_textures,
                                                    TextureReader& textures);

/// Returns the faces of elements that are one whole cube with a texture on each side; nullopt for others.
[[nodiscard]] std::optional<std::array<VoxelFace, 6>> faces_of_cube(const std::vector<ShapeElement>& elements);

}  // namespace quoin::packs
