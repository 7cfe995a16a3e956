#include "scene/meshes/occlusion_atlas.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>
#include <quoin/mesh/occlusion.h>

#include "core/srgb.h"

namespace quoin {

namespace {

constexpr std::size_t kCorners = 4;

/// A face of a mesh, derived from its first four vertices.
struct Face {
  Direction direction = Direction::PosX;
  IVec3 chunk{0};
  IVec3 voxel{0};  ///< the lowest, in the chunk
  int size_u = 1;
  int size_v = 1;
};

IVec3 voxel_corner(const Vec3& position) {
  return {static_cast<int>(position.x), static_cast<int>(position.y), static_cast<int>(position.z)};
}

Face face_of(const BlockyTriangles& mesh, std::size_t first_vertex) {
  QUOIN_ASSERT(first_vertex % kCorners == 0 && first_vertex < mesh.positions.size(), "the first vertex of a face");
  Face face;
  face.direction = mesh.directions[first_vertex];
  const FaceFrame& frame = frame_of(face.direction);
  const IVec3 lowest = voxel_corner(mesh.positions[first_vertex]);
  const IVec3 highest = voxel_corner(mesh.positions[first_vertex + 2]);
  face.size_u = highest[frame.u] - lowest[frame.u];
  face.size_v = highest[frame.v] - lowest[frame.v];
  face.voxel = lowest;
  if (frame.sign > 0) face.voxel[frame.axis] -= 1;
  face.chunk = chunk_of(face.voxel);
  face.voxel -= face.chunk * kChunkEdge;
  return face;
}

/// Returns the index of the first occlusion level of a voxel's face.
std::size_t place_of(const Face& face, int u, int v) {
  const FaceFrame& frame = frame_of(face.direction);
  const auto edge = static_cast<std::size_t>(kChunkEdge);
  const auto layer = static_cast<std::size_t>(face.voxel[frame.axis]);
  const auto row = static_cast<std::size_t>(face.voxel[frame.v] + v);
  const auto column = static_cast<std::size_t>(face.voxel[frame.u] + u);
  QUOIN_ASSERT(layer < edge && row < edge && column < edge, "a voxel of the chunk");
  return (((static_cast<std::size_t>(face.direction) * edge + layer) * edge + row) * edge + column) * kCorners;
}

/// Returns true if all rows (or, with a stride of one texel, columns) are equal.
bool is_constant(const std::vector<std::uint8_t>& levels, std::size_t first, int columns, int rows, bool along_rows) {
  const auto at = [&](int column, int row) {
    return levels[first + static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(column)];
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (at(column, row) != (along_rows ? at(0, row) : at(column, 0))) return false;
    }
  }
  return true;
}

}  // namespace

void OcclusionAtlas::paint(const BlockyTriangles& split, std::size_t first_vertex) {
  const Face face = face_of(split, first_vertex);
  for (int v = 0; v < face.size_v; ++v) {
    for (int u = 0; u < face.size_u; ++u) {
      // Faces merge only along directions of constant occlusion, so each voxel has the occlusion of the whole face.
      std::copy_n(split.occlusion.begin() + static_cast<std::ptrdiff_t>(first_vertex), kCorners,
                  faces_.begin() + static_cast<std::ptrdiff_t>(place_of(face, u, v)));
    }
  }
}

std::size_t OcclusionAtlas::patch_of(const BlockyTriangles& merged, std::size_t first_vertex, Rgba8 colour) {
  const Face face = face_of(merged, first_vertex);
  Patch patch{face.size_u + 1, face.size_v + 1, 0, 0, colour, levels_.size()};
  // The corner of a voxel's face at its lower or upper end along u and v.
  constexpr std::array<std::array<std::size_t, 2>, 2> kCornerAt = {{{0, 3}, {1, 2}}};
  for (int v = 0; v <= face.size_v; ++v) {
    for (int u = 0; u <= face.size_u; ++u) {
      const bool is_last_u = u == face.size_u;
      const bool is_last_v = v == face.size_v;
      const std::size_t corner = kCornerAt[std::size_t{is_last_u}][std::size_t{is_last_v}];
      levels_.push_back(faces_[place_of(face, u - int{is_last_u}, v - int{is_last_v}) + corner]);
    }
  }
  const std::size_t first = patch.first_level;
  const auto columns = static_cast<std::size_t>(patch.columns);
  if (is_constant(levels_, first, patch.columns, patch.rows, true)) {
    for (std::size_t row = 0; row < static_cast<std::size_t>(patch.rows); ++row) {
      levels_[first + row] = levels_[first + row * columns];
    }
    patch.columns = 1;
  }
  if (is_constant(levels_, first, patch.columns, patch.rows, false)) patch.rows = 1;
  levels_.resize(first + static_cast<std::size_t>(patch.columns) * static_cast<std::size_t>(patch.rows));
  key_.assign({static_cast<char>(colour.r), static_cast<char>(colour.g), static_cast<char>(colour.b),
               static_cast<char>(patch.columns)});
  key_.append(levels_.begin() + static_cast<std::ptrdiff_t>(first), levels_.end());
  const auto [found, is_new] = known_.try_emplace(key_, patches_.size());
  if (is_new) {
    patches_.push_back(patch);
  } else {
    levels_.resize(first);
  }
  return found->second;
}

std::size_t OcclusionAtlas::add(const BlockyTriangles& split, const BlockyTriangles& merged,
                                const VoxelRegistry& types) {
  QUOIN_ASSERT(split.positions.size() % kCorners == 0 && merged.positions.size() % kCorners == 0, "faces of four");
  faces_.resize(std::size_t{6} * kChunkEdge * kChunkEdge * kChunkEdge * kCorners);
  std::vector<std::size_t>& faces = additions_.emplace_back();
  faces.reserve(merged.positions.size() / kCorners);
  std::size_t next = 0;
  // Both meshes have their faces chunk by chunk, in the same order of chunks.
  for (std::size_t at = 0; at < merged.positions.size();) {
    const IVec3 chunk = face_of(merged, at).chunk;
    for (; next < split.positions.size() && face_of(split, next).chunk == chunk; next += kCorners) paint(split, next);
    for (; at < merged.positions.size() && face_of(merged, at).chunk == chunk; at += kCorners) {
      const VoxelType type = merged.types[at];
      const Rgba8 colour = type < types.size() ? types[type].colour : Rgba8{};
      faces.push_back(patch_of(merged, at, colour));
    }
  }
  QUOIN_ASSERT(next == split.positions.size(), "both of the same faces");
  return additions_.size() - 1;
}

// Packs patches on shelves of decreasing height. Returns false if they do not fit into the square.
bool OcclusionAtlas::place(const std::vector<std::size_t>& order, int edge, int& height) {
  int x = 0;
  int y = 0;
  int shelf = 0;
  for (const std::size_t i : order) {
    Patch& patch = patches_[i];
    if (x + patch.columns > edge) {
      y += shelf;
      x = 0;
      shelf = 0;
    }
    shelf = std::max(shelf, patch.rows);
    if (y + shelf > edge) return false;
    patch.x = x;
    patch.y = y;
    x += patch.columns;
  }
  height = y + shelf;
  return true;
}

Result<Image> OcclusionAtlas::draw() {
  std::vector<std::size_t> order(patches_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    const Patch& first = patches_[a];
    const Patch& second = patches_[b];
    return first.rows != second.rows ? first.rows > second.rows : first.columns > second.columns;
  });
  int edge = 2 * kChunkEdge;
  int used = 1;
  while (!place(order, edge, used)) {
    edge *= 2;
    if (edge > kMaxEdge) {
      return make_error(ErrorCode::LimitExceeded, "the atlas needs a texture larger than " + std::to_string(kMaxEdge) +
                                                      " texels per side; mesh without an atlas");
    }
  }
  QUOIN_ASSERT(used <= edge, "patches within the square");
  width_ = edge;
  height_ = static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(used, 1))));
  Image image{width_, height_, {}};
  image.rgb.resize(std::size_t{3} * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  const SrgbEncoder& encode = SrgbEncoder::shared();
  for (const Patch& patch : patches_) {
    std::array<std::array<std::uint8_t, 3>, 4> looks{};
    for (std::uint8_t level = 0; level < 4; ++level) {
      const float brightness = occlusion_brightness(level);
      const auto shaded = [&](std::uint8_t channel) { return encode(linear_from_srgb(channel) * brightness); };
      looks[level] = {shaded(patch.colour.r), shaded(patch.colour.g), shaded(patch.colour.b)};
    }
    const std::uint8_t* level = levels_.data() + patch.first_level;
    for (int row = 0; row < patch.rows; ++row) {
      const auto first = static_cast<std::size_t>(patch.y + row) * static_cast<std::size_t>(width_) +
                         static_cast<std::size_t>(patch.x);
      std::uint8_t* out = image.rgb.data() + 3 * first;
      for (int column = 0; column < patch.columns; ++column) out = std::ranges::copy(looks[*level++], out).out;
    }
  }
  return image;
}

std::vector<std::array<float, 2>> OcclusionAtlas::coordinates(std::size_t addition) const {
  QUOIN_ASSERT(addition < additions_.size() && width_ > 0, "an addition, once it is drawn");
  std::vector<std::array<float, 2>> all;
  all.reserve(additions_[addition].size() * kCorners);
  // Powers of two, so that products are exact.
  const float texel_u = 1.0F / static_cast<float>(width_);
  const float texel_v = 1.0F / static_cast<float>(height_);
  for (const std::size_t i : additions_[addition]) {
    const Patch& patch = patches_[i];
    for (std::size_t corner = 0; corner < kCorners; ++corner) {
      const int column = patch.x + (corner == 1 || corner == 2 ? patch.columns - 1 : 0);
      const int row = patch.y + (corner >= 2 ? patch.rows - 1 : 0);
      all.push_back({(static_cast<float>(column) + 0.5F) * texel_u, (static_cast<float>(row) + 0.5F) * texel_v});
    }
  }
  return all;
}

}  // namespace quoin
