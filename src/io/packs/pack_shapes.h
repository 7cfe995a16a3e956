#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/function_ref.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_shape.h>

#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/pack_textures.h"

// Models of resource packs as elements of shapes, or as the faces of cubes.

namespace quoin::packs {

/// Returns the orientation of a model in a block state.
[[nodiscard]] AxisOrientation orientation_of(const StateModel& state);

/// Returns the element that a model shows when it is turned and its textures keep their place in the world (`uvlock`).
/// Its faces have parts (PackFace::uv). Requires: the turn is a rotation.
[[nodiscard]] PackElement turned_with_world(const PackElement& element, const AxisOrientation& turn);

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
