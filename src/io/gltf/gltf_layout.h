#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene_meshes.h>

#include "io/material_palette.h"
#include "io/mesh_parts.h"

namespace quoin {

/// A stretch of a glTF buffer; `offset` and `bytes` are multiples of four but for images and short indices.
struct GltfView {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};

/// One primitive's arrays and where they lie, in the order in which they are written.
struct GltfPrimitive {
  MeshView view;
  std::size_t material = 0;
  bool wide_indices = false;  ///< 32 bits instead of 16
  Vec3 min{0.0F};             ///< of the positions as written
  Vec3 max{0.0F};
  GltfView positions;
  GltfView normals;
  GltfView texture_coordinates;  ///< 0 bytes for smooth ones
  GltfView colours;              ///< 0 bytes for blocks without occlusion, or with that of its own
  GltfView occlusion;            ///< of its own: 0 bytes where it is in the colours, or there is none
  GltfView indices;
};

/// A part's mesh as the file has it: with what nodes cannot say baked in.
struct GltfMesh {
  std::string name;
  VertexTransform transform;  ///< from the part, relative to its pivot
  std::vector<GltfPrimitive> primitives;
};

/// Translation, rotation and scale of a node, after what is baked into its mesh: a reflection or a shear.
struct GltfTransform {
  DVec3 translation{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  DVec3 scale{1.0};
  glm::dmat3 baked{1.0};
};

struct GltfNode {
  std::string name;
  std::optional<std::size_t> mesh;  ///< none where there is nothing to draw
  GltfTransform transform;          ///< from the node above, or the world
  std::string layer{};
  std::vector<std::size_t> children{};
  bool is_group = false;
  bool is_at_top = true;
};

struct GltfImage {
  std::string name;
  std::vector<std::byte> png;
  GltfView view;
};

/// Where everything lies in the buffer of a glTF file; borrows the meshes' arrays.
struct GltfLayout {
  MaterialPalette palette;
  std::vector<GltfNode> nodes;  ///< the placements in their order, then the groups
  std::vector<GltfMesh> meshes;
  std::vector<GltfImage> images;           ///< of blocks: base colour, metallic-roughness, perhaps emissive
  std::vector<MaterialSurfaces> surfaces;  ///< of every part
  std::uint64_t buffer_bytes = 0;
};

/// Requires: sound meshes that outlive the layout. Errors: LimitExceeded from the PNG encoder.
[[nodiscard]] Result<GltfLayout> lay_out_gltf(const SceneMeshes& meshes, OcclusionIn occlusion = OcclusionIn::Colour);

/// The JSON of a glTF file: compact, in a fixed order, names made valid UTF-8. `buffer_uri` names the file that holds
/// the buffer, percent-encoded; empty for the GLB's own.
[[nodiscard]] std::string gltf_json(const GltfLayout& layout, std::string_view buffer_uri);

/// The size of a GLB with chunks of these sizes. Errors: LimitExceeded when it does not fit the header's 32 bits.
[[nodiscard]] Result<std::uint64_t> glb_file_bytes(std::uint64_t json_bytes, std::uint64_t buffer_bytes);

}  // namespace quoin
