// Boxes grow from the lowest remaining voxel: along x, then y, then z.
//
//   z = 0   . # # .      z = 1   . # # .      the run 1..2 of the first row, both rows of z = 0 and
//           . # # #              . # # .      and z = 1: one box of 2 x 2 x 2; the voxel at (3, 1, 0) remains
//
// Faces are rectangles of a layer, which is 64 words of 64 bits in each direction: layers across x are transposed.
#include "scene/solid_shapes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/grid/changes.h>
#include <quoin/mesh/quad_triangles.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "grid/shapes/shape_index.h"
#include "trace/chunk_rows.h"

namespace quoin {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::size_t kEdge = kChunkEdge;

using SolidRows = std::array<std::uint64_t, kEdge * kEdge>;  // the solid voxels of a chunk: bit x of word y + 64 z

using Layer = std::array<std::uint64_t, kEdge>;  // bit u of word v

bool is_solid(const VoxelRegistry& types, VoxelType type) {
  return type != kAir && (type >= types.size() || types[type].collides);
}

bool is_solid_cube(const VoxelRegistry& types, VoxelType type) {
  return is_solid(types, type) && !types.is_shaped(type);
}

// Gets a chunk's solid cubes. Returns false, without setting the rows, if the chunk is null or no voxel is solid.
bool read_solid_rows(const Chunk* chunk, const VoxelRegistry& types, SolidRows& rows) {
  if (chunk == nullptr) return false;
  const auto counts = [&](VoxelType type) { return is_solid_cube(types, type); };
  const FunctionRef<bool(VoxelType)> asked(counts);
  const trace::ChunkRows read(*chunk, asked);
  if (read.none()) return false;
  rows.fill(0);
  read.for_each_row(kWholeChunk, [&](int y, int z, std::uint64_t row) {
    rows[static_cast<std::size_t>(z) * kEdge + static_cast<std::size_t>(y)] = row;
  });
  return true;
}

// Returns the lowest run of ones in a non-zero word.
std::uint64_t lowest_run(std::uint64_t word) {
  QUOIN_ASSERT(word != 0, "a word with ones");
  const std::uint64_t above = word + (word & (~word + 1));  // 0 if the run ends at the top
  return word & ~above;
}

std::size_t rows_along_y(const SolidRows& rows, std::size_t row, std::uint64_t run) {
  QUOIN_ASSERT(row < rows.size(), "one of the rows");
  std::size_t end = row + 1;
  while (end % kEdge != 0 && (rows[end] & run) == run) ++end;
  return end - row;
}

bool has_all(const SolidRows& rows, std::size_t row, std::size_t count, std::uint64_t run) {
  QUOIN_ASSERT(row + count <= rows.size(), "rows of the chunk");
  return std::all_of(rows.begin() + static_cast<std::ptrdiff_t>(row),
                     rows.begin() + static_cast<std::ptrdiff_t>(row + count),
                     [&](std::uint64_t word) { return (word & run) == run; });
}

void cut_boxes(SolidRows& rows, std::vector<IBox>& out) {
  for (std::size_t row = 0; row < rows.size(); ++row) {
    while (rows[row] != 0) {
      const std::uint64_t run = lowest_run(rows[row]);
      const std::size_t height = rows_along_y(rows, row, run);
      std::size_t depth = 1;
      while (row + depth * kEdge < rows.size() && has_all(rows, row + depth * kEdge, height, run)) ++depth;
      for (std::size_t z = 0; z < depth; ++z) {
        for (std::size_t y = 0; y < height; ++y) rows[row + z * kEdge + y] &= ~run;
      }
      const IVec3 low{std::countr_zero(run), static_cast<int>(row % kEdge), static_cast<int>(row / kEdge)};
      const IVec3 size{std::popcount(run), static_cast<int>(height), static_cast<int>(depth)};
      out.push_back({low, low + size});
    }
  }
}

// Transposes a layer: bit j of word i becomes bit i of word j.
void transpose(Layer& words) {
  std::uint64_t mask = kAll >> 32;
  for (std::size_t distance = 32; distance != 0; distance /= 2, mask ^= mask << distance) {
    for (std::size_t i = 0; i < kEdge; ++i) {
      if ((i & distance) != 0) continue;
      const std::uint64_t other = (words[i] >> distance ^ words[i + distance]) & mask;
      words[i] ^= other << distance;
      words[i + distance] ^= other;
    }
  }
}

// Cuts the faces of a layer into rectangles, along the words first.
void cut_faces(Layer& faces, Direction direction, bool is_u_in_word, int layer, QuadBuffer& out) {
  QUOIN_ASSERT(layer >= 0 && layer < kChunkEdge, "0 <= layer < 64");
  const FaceFrame& frame = frame_of(direction);
  for (std::size_t row = 0; row < kEdge; ++row) {
    while (faces[row] != 0) {
      const std::uint64_t run = lowest_run(faces[row]);
      std::size_t end = row;
      while (end < kEdge && (faces[end] & run) == run) faces[end++] &= ~run;
      const int along = std::popcount(run) - 1;
      const auto across = static_cast<int>(end - row) - 1;
      IVec3 voxel;
      voxel[frame.axis] = layer;
      voxel[is_u_in_word ? frame.u : frame.v] = std::countr_zero(run);
      voxel[is_u_in_word ? frame.v : frame.u] = static_cast<int>(row);
      Quad quad;
      QUOIN_ASSERT(along >= 0 && along < kChunkEdge && across >= 0 && across < kChunkEdge, "sizes of 6 bits");
      const auto put = [&](int value, int shift) { quad.bits |= static_cast<std::uint64_t>(value) << shift; };
      for (int axis = 0; axis < 3; ++axis) put(voxel[axis], 6 * axis);
      put(is_u_in_word ? along : across, Quad::kSizeUShift);
      put(is_u_in_word ? across : along, Quad::kSizeVShift);
      put(static_cast<int>(direction), Quad::kDirectionShift);
      out.push_back(quad);
    }
  }
}

/// A chunk's solid voxels and their neighbours, in layers across one axis.
class SolidLayers {
 public:
  SolidLayers(const SolidRows& rows, int axis) : rows_(rows), axis_(axis) {
    QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
    if (axis != 0) return;
    for (std::size_t z = 0; z < kEdge; ++z) {
      Layer slice;
      std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(z * kEdge), kEdge, slice.begin());
      transpose(slice);
      for (std::size_t x = 0; x < kEdge; ++x) across_x_[x][z] = slice[x];
    }
  }
  /// x: bit y of word z. y: bit x of word z. z: bit x of word y.
  [[nodiscard]] Layer at(std::size_t layer) const {
    QUOIN_ASSERT(layer < kEdge, "0 <= layer < 64");
    if (axis_ == 0) return across_x_[layer];
    Layer words;
    for (std::size_t i = 0; i < kEdge; ++i) words[i] = axis_ == 1 ? rows_[i * kEdge + layer] : rows_[layer * kEdge + i];
    return words;
  }

 private:
  const SolidRows& rows_;
  int axis_;
  std::array<Layer, kEdge> across_x_;
};

// Returns the layer of a neighbour that touches the chunk.
Layer layer_beside(const Chunk* neighbour, const VoxelRegistry& types, Direction direction) {
  Layer adjacent{};
  SolidRows rows;
  if (!read_solid_rows(neighbour, types, rows)) return adjacent;
  const FaceFrame& frame = frame_of(direction);
  return SolidLayers(rows, frame.axis).at(frame.sign > 0 ? 0 : kEdge - 1);
}

}  // namespace

void append_solid_boxes(const Chunk& chunk, const VoxelRegistry& types, std::vector<IBox>& out) {
  SolidRows rows;
  if (read_solid_rows(&chunk, types, rows)) cut_boxes(rows, out);
}

void append_shape_boxes(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, std::vector<DBox>& out) {
  const Chunk* const voxels = types.has_shapes() ? grid.find_chunk(chunk) : nullptr;
  if (voxels == nullptr) return;
  const auto counts = [&](VoxelType type) { return is_solid(types, type) && types.is_shaped(type); };
  const FunctionRef<bool(VoxelType)> asked(counts);
  const trace::ChunkRows read(*voxels, asked);
  if (read.none()) return;
  SolidRows rows{};
  read.for_each_row(kWholeChunk, [&](int y, int z, std::uint64_t row) {
    rows[static_cast<std::size_t>(z) * kEdge + static_cast<std::size_t>(y)] = row;
  });
  const Neighbourhood near = grid.neighbourhood(chunk);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::uint64_t left = rows[row]; left != 0; left &= left - 1) {
      const IVec3 local{std::countr_zero(left), static_cast<int>(row % kEdge), static_cast<int>(row / kEdge)};
      visit_solid_boxes(*shape_at(near, types, local), false, [&](const DBox& box) {
        out.push_back({box.min + DVec3(local), box.max + DVec3(local)});
      });
    }
  }
}

void append_solid_faces(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, QuadBuffer& out) {
  SolidRows rows;
  if (!read_solid_rows(grid.find_chunk(chunk), types, rows)) return;
  std::optional<SolidLayers> layers;
  for (const Direction direction : kDirections) {
    const FaceFrame& frame = frame_of(direction);
    const bool is_up = frame.sign > 0;
    if (is_up) layers.emplace(rows, frame.axis);  // also used by the opposite direction, which follows
    // The bits of a word lie along the lower of the other two axes.
    const bool is_u_in_word = frame.u < frame.v;
    for (std::size_t i = 0; i < kEdge; ++i) {
      const bool is_last = i == (is_up ? kEdge - 1 : 0);
      Layer faces = layers->at(i);
      const Layer next = is_last ? layer_beside(grid.find_chunk(chunk + normal_of(direction)), types, direction)
                                 : layers->at(is_up ? i + 1 : i - 1);
      for (std::size_t row = 0; row < kEdge; ++row) faces[row] &= ~next[row];
      cut_faces(faces, direction, is_u_in_word, static_cast<int>(i), out);
    }
  }
}

SolidMesh solid_mesh(const QuadBuffer& faces) {
  SolidMesh mesh;
  mesh.positions.resize(vertices_needed(faces.size()));
  mesh.indices.resize(indices_needed(faces.size()));
  for_each_vertex(faces, [&](std::size_t i, const QuadVertex& vertex) { mesh.positions[i] = Vec3(vertex.position); });
  write_indices<std::uint32_t>(faces, 0, mesh.indices);
  return mesh;
}

namespace {

struct ChunkShapes {
  std::vector<IBox> boxes;
  QuadBuffer faces;
  std::vector<DBox> of_shapes;

  [[nodiscard]] bool empty() const { return boxes.empty() && faces.empty() && of_shapes.empty(); }
  bool operator==(const ChunkShapes& other) const {
    const auto is_same = [](const DBox& a, const DBox& b) { return a.min == b.min && a.max == b.max; };
    return boxes == other.boxes && faces == other.faces && std::ranges::equal(of_shapes, other.of_shapes, is_same);
  }
};

std::vector<bool> solid_types(const VoxelRegistry& types) {
  std::vector<bool> solid(types.size());
  for (std::size_t i = 1; i < solid.size(); ++i) solid[i] = is_solid(types, static_cast<VoxelType>(i));
  return solid;
}

}  // namespace

struct SolidShapes::Impl {
  [[nodiscard]] bool follow_types(const VoxelRegistry& types);
  [[nodiscard]] std::vector<IVec3> chunks_to_make(const Grid& grid, const GridChanges& changes,
                                                  const DataChanges& data) const;
  void make(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, ChunkShapes& made) const;

  SolidShapesOptions options;
  ChangeCursor followed_grid;
  ChangeCursor followed_types;
  std::vector<bool> solid;
  std::unordered_map<IVec3, ChunkShapes, CoordinateHash> shapes;
};

// Returns true if types became solid or ceased to be, or if shapes changed.
bool SolidShapes::Impl::follow_types(const VoxelRegistry& types) {
  PendingChanges changes(followed_types, types);
  if (changes->empty()) return false;
  std::vector<bool> now = solid_types(types);
  // Unregistered types are solid.
  const auto is_other = [&](std::size_t i) { return (i >= now.size() || now[i]) != (i >= solid.size() || solid[i]); };
  bool is_any_other = changes->all && types.has_shapes();
  // Shapes connect to opaque types.
  for (const TypeChange& change : changes->items_unless_all()) {
    is_any_other |= change.shape_changed || (change.visibility_changed && types.has_shapes());
  }
  for (std::size_t i = 1; i < std::max(now.size(), solid.size()); ++i) is_any_other |= is_other(i);
  solid = std::move(now);
  changes.commit();
  return is_any_other;
}

// Returns the chunks whose shapes may have changed: all chunks that have or had shapes if everything changed.
std::vector<IVec3> SolidShapes::Impl::chunks_to_make(const Grid& grid, const GridChanges& changes,
                                                     const DataChanges& data) const {
  std::vector<IVec3> chunks = chunks_to_mesh(grid, changes);
  // Shapes follow the state of their neighbours.
  for (const DataChange& change : data.items_unless_all()) add_chunks_near(change.chunk, change.box, 1, chunks);
  if (!data.empty()) sort_and_unite(chunks);
  if (!changes.all) return chunks;
  for (const auto& [chunk, shape] : shapes) {
    if (grid.find_chunk(chunk) == nullptr) chunks.push_back(chunk);
  }
  sort_and_unite(chunks);
  return chunks;
}

void SolidShapes::Impl::make(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, ChunkShapes& made) const {
  const Chunk* found = grid.find_chunk(chunk);
  if (found == nullptr) return;
  if (options.boxes) append_solid_boxes(*found, types, made.boxes);
  if (options.faces) append_solid_faces(grid, chunk, types, made.faces);
  append_shape_boxes(grid, chunk, types, made.of_shapes);
}

SolidShapes::SolidShapes(const SolidShapesOptions& options) : impl_(std::make_unique<Impl>()) {
  impl_of(impl_).options = options;
}
SolidShapes::SolidShapes(SolidShapes&&) noexcept = default;
SolidShapes& SolidShapes::operator=(SolidShapes&&) noexcept = default;
SolidShapes::~SolidShapes() = default;

std::vector<IVec3> SolidShapes::update(const Grid& grid, const VoxelRegistry& types, Threads threads) {
  Impl& me = impl_of(impl_);
  if (me.follow_types(types)) me.followed_grid = {};
  ChangeCursor followed_data = me.followed_grid;
  PendingChanges changes(me.followed_grid, grid);
  DataChanges data;
  if (types.has_shapes()) data = grid.data_changes_since(followed_data);
  if (!data.empty()) me.followed_grid = {};  // until `commit`
  if (data.all) changes->all = true;
  const std::vector<IVec3> chunks = me.chunks_to_make(grid, *changes, data);
  std::vector<ChunkShapes> made(chunks.size());
  parallel_for(chunks.size(), threads, [&](std::size_t i) { me.make(grid, chunks[i], types, made[i]); });
  std::vector<IVec3> changed;
  changed.reserve(chunks.size());
  // Nothing throws once the first chunk is replaced, so that each change is reported.
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (!made[i].empty()) me.shapes.try_emplace(chunks[i]);
  }
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    const auto found = me.shapes.find(chunks[i]);
    const bool is_same = found == me.shapes.end() ? made[i].empty() : found->second == made[i];
    if (is_same) continue;
    changed.push_back(chunks[i]);
    if (made[i].empty()) {
      me.shapes.erase(found);
    } else {
      found->second = std::move(made[i]);
    }
  }
  changes.commit();
  return changed;
}

const std::vector<IBox>& SolidShapes::boxes(IVec3 chunk) const {
  static const std::vector<IBox> none;
  const auto found = impl_of(impl_).shapes.find(chunk);
  return found == impl_of(impl_).shapes.end() ? none : found->second.boxes;
}

const QuadBuffer& SolidShapes::faces(IVec3 chunk) const {
  static const QuadBuffer none;
  const auto found = impl_of(impl_).shapes.find(chunk);
  return found == impl_of(impl_).shapes.end() ? none : found->second.faces;
}

const std::vector<DBox>& SolidShapes::shape_boxes(IVec3 chunk) const {
  static const std::vector<DBox> none;
  const auto found = impl_of(impl_).shapes.find(chunk);
  return found == impl_of(impl_).shapes.end() ? none : found->second.of_shapes;
}

std::size_t SolidShapes::bytes() const {
  std::size_t sum = impl_of(impl_).shapes.size() * sizeof(ChunkShapes);
  for (const auto& [chunk, shape] : impl_of(impl_).shapes) {
    sum += shape.boxes.capacity() * sizeof(IBox) + shape.faces.capacity() * sizeof(Quad);
    sum += shape.of_shapes.capacity() * sizeof(DBox);
  }
  return sum;
}

}  // namespace quoin
