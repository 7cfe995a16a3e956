#include "render/vulkan/raster/mesh_store.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <tuple>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/downsample.h>

#include "core/caches.h"
#include "render/vulkan/raster/mesh_shader_data.h"
#include "render/vulkan/trees/shader_data.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/tree_cache.h"

namespace quoin::vulkan {
namespace {

// Replaced meshes stay until their replacement has arrived; this limits their memory at a time.
constexpr std::size_t kBatchBytes = std::size_t{32} << 20;

void append_vertex(const ChunkSurface& surface, std::size_t i, std::vector<std::uint32_t>& words) {
  QUOIN_ASSERT(i < surface.smooth.positions.size(), "a vertex of the surface");
  const SmoothChunkMesh& mesh = surface.smooth;
  const Vec3 position = mesh.positions.data()[i];
  for (int axis = 0; axis < 3; ++axis) words.push_back(std::bit_cast<std::uint32_t>(position[axis]));
  words.push_back(octahedral(mesh.normals.data()[i]));
  const float open = mesh.occlusion.empty() ? 1.0F : 1.0F - std::clamp(mesh.occlusion.data()[i], 0.0F, 1.0F);
  const LinearRgba16 albedo = surface.albedo[i];
  words.push_back(albedo[0] | std::uint32_t{albedo[1]} << 16);
  words.push_back(albedo[2] | static_cast<std::uint32_t>(std::lround(open * 65535.0F)) << 16);
  words.push_back(surface.types[i]);
}

void append_materials(const VertexMaterials& materials, std::vector<std::uint32_t>& words) {
  const auto& [types, weights] = materials;
  words.push_back(types[0] | std::uint32_t{types[1]} << 16);
  words.push_back(types[2] | std::uint32_t{types[3]} << 16);
  words.push_back(weights[0] | std::uint32_t{weights[1]} << 8 | std::uint32_t{weights[2]} << 16 |
                  std::uint32_t{weights[3]} << 24);
}

// Rejects indices and sizes that would make a device read outside the surface's memory.
Status check(const ChunkSurface& surface) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (surface.style == SurfaceStyle::Blocky) {
    if (surface.opaque_quads > surface.quads.size()) return refuse("surface: more opaque quads than quads");
    if (surface.opaque_shapes > surface.shapes.size()) return refuse("surface: more opaque shapes than shapes");
    const bool has_faces = std::ranges::all_of(surface.shapes, [](const ShapeFace& shape) {
      return shape.model != nullptr && shape.face < shape.model->faces.size();
    });
    if (!has_faces) return refuse("surface: a shape's face is not one of its model");
    return {};
  }
  const SmoothChunkMesh& mesh = surface.smooth;
  const std::size_t count = mesh.positions.size();
  const bool is_whole = mesh.normals.size() == count && surface.albedo.size() == count &&
                        surface.types.size() == count && (mesh.occlusion.empty() || mesh.occlusion.size() == count) &&
                        (surface.materials.empty() || surface.materials.size() == count);
  if (!is_whole) return refuse("surface: its vertex arrays have different lengths");
  const bool is_of_triangles = mesh.indices.size() % 3 == 0 && surface.glass_indices % 3 == 0;
  if (!is_of_triangles) return refuse("surface: its index counts are not multiples of 3");
  if (surface.glass_indices > mesh.indices.size()) return refuse("surface: more glass indices than indices");
  const bool is_inside =
      std::all_of(mesh.indices.begin(), mesh.indices.end(), [&](std::uint32_t index) { return index < count; });
  if (!is_inside) return refuse("surface: an index is out of range");
  return {};
}

void set_directions(std::span<const Quad> opaque, StoredMesh& mesh) {
  mesh.opaque.back() = static_cast<std::uint32_t>(opaque.size());
  const auto is_before = [](const Quad& a, const Quad& b) { return a.direction() < b.direction(); };
  mesh.is_by_direction = std::is_sorted(opaque.begin(), opaque.end(), is_before);
  if (!mesh.is_by_direction) return;
  for (std::size_t i = 1; i < 6; ++i) {
    const auto from = std::partition_point(
        opaque.begin(), opaque.end(), [=](const Quad& quad) { return static_cast<std::size_t>(quad.direction()) < i; });
    mesh.opaque[i] = static_cast<std::uint32_t>(from - opaque.begin());
  }
}

void set_glass_types(StoredMesh& mesh) {
  std::vector<VoxelType>& types = mesh.glass_types;
  const auto add = [&](VoxelType type) {
    if (types.empty() || types.back() != type) types.push_back(type);
  };
  for (const Quad& quad : mesh.glass) add(quad.type());
  for (const GlassShape& shape : mesh.shapes.glass) add(shape.type);
  std::ranges::sort(types);
  types.erase(std::ranges::unique(types).begin(), types.end());
  types.shrink_to_fit();
}

// Returns kIsOpen if an element lacks sides, so that the inner sides of the others can be seen; kIsPlate for a plate
// whose other side is drawn.
std::uint32_t openness_bits(const ShapeModel& model, std::uint16_t face) {
  for (const ModelBox& box : model.boxes) {
    const auto side = std::ranges::find(box.faces, static_cast<std::int16_t>(face));
    if (side == box.faces.end()) continue;
    const auto number = static_cast<std::size_t>(side - box.faces.begin());
    const int axis = static_cast<int>(number / 2);
    if (box.min[axis] == box.max[axis]) return box.faces[number ^ 1U] < 0 ? kIsOpen : kIsPlate;
    return std::ranges::any_of(box.faces, [](std::int16_t each) { return each < 0; }) ? kIsOpen : 0;
  }
  return 0;
}

// Returns the square of the sides of the texture per voxel.
float square_density(const ModelFace& face) {
  const std::size_t middle = face.corners[1] == face.corners[2] ? 2 : 1;  // a corner may be there twice
  const Vec3 edge = face.corners[middle] - face.corners[0];
  const float right = face.uv[middle][0] - face.uv[0][0];
  const float down = face.uv[middle][1] - face.uv[0][1];
  return (right * right + down * down) / glm::dot(edge, edge);
}

// Returns the texture of a face's own look: white without one, so that the tint is seen. Returns null if the face shows
// its type's look, or is glass without a texture, which has the colour of its type.
const Texture* own_texture(const ShapeFace& face, bool is_transparent) {
  static const Texture white = [] {
    constexpr int kSize = kMinTextureSize;
    const AlphaImage image{kSize, kSize, std::vector<std::uint8_t>(std::size_t{4} * kSize * kSize, 255)};
    return Texture::from_image("white", image).value();
  }();
  const std::uint16_t look = face.model_face().look;
  if (look < 6) return nullptr;
  const Texture& own = face.model->looks[look - std::size_t{6}].texture;
  if (!own.is_null()) return &own;
  return is_transparent ? nullptr : &white;
}

// `texture`: see `own_texture`. `texels`: their address.
ShaderShapeRecord shape_record(const ShapeModel& model, std::uint16_t number, const Texture* texture,
                               std::uint64_t texels) {
  const ModelFace& face = model.faces[number];
  ShaderShapeRecord record;
  for (std::size_t i = 0; i < 4; ++i) {
    record.corners[i] = Vec4(face.corners[i], face.uv[i][0]);
    record.down[static_cast<int>(i)] = face.uv[i][1];
  }
  record.normal = Vec4(face.normal, square_density(face));
  record.bits = openness_bits(model, number) | static_cast<std::uint32_t>(face.direction) << kNormalShift;
  if (face.on_side) record.bits |= kIsOnVoxel;
  if (face.look < 6) {
    record.bits |= std::uint32_t{face.look} << kTypeLookShift;
    return record;
  }
  const VoxelFace& look = model.looks[face.look - std::size_t{6}];
  record.tint = packed_colour({look.tint.r, look.tint.g, look.tint.b, look.emission_share});
  if (texture == nullptr) {
    record.bits |= kNoLook << kTypeLookShift;
    return record;
  }
  record.texels = texels;
  record.bits |= kOwnLook | static_cast<std::uint32_t>(texture->level_count() - 1) |
                 static_cast<std::uint32_t>(look.alpha) << kAlphaShift;
  return record;
}

ShaderShapeFace shader_face(const ShapeFace& face, std::size_t record) {
  const bool flips = !face.is_triangle() && flips_diagonal(face.occlusion());
  const auto number = static_cast<std::uint32_t>(record);
  return {(face.bits & (kShapeIsFlipped - 1)) | (flips ? kShapeIsFlipped : 0) | number >> 16U << kRecordHighShift,
          face.type | number << 16U};
}

// Returns a face of transparent material as glass; nullopt if its own look hides the background.
std::optional<GlassShape> glass_shape(const ShapeFace& face, std::size_t number) {
  const ModelFace& shown = face.model_face();
  if (shown.look >= 6) {
    const VoxelFace& look = face.model->looks[shown.look - std::size_t{6}];
    if (!look.texture.is_null() && look.alpha != FaceAlpha::Translucent) return std::nullopt;
  }
  const Vec3 centre = 0.5F * (face.corner(0) + face.corner(2));
  return GlassShape{centre, shown.normal, static_cast<std::uint32_t>(number), face.type,
                    static_cast<std::uint8_t>(std::min<std::uint16_t>(shown.look, 6))};
}

}  // namespace

MeshStore::~MeshStore() {
  clear();
}

void MeshStore::clear() {
  for (auto& [key, grid] : grids_) {
    for (auto& [at, mesh] : grid.chunks) memory_->release(mesh.place);
  }
  grids_.clear();
  chunks_ = chunks_with_glass_ = bytes_ = 0;
  triangles_ = 0;
}

Status MeshStore::put(std::span<const SurfaceUpdate> surfaces, int level) {
  for (const SurfaceUpdate& update : surfaces) {
    if (update.surface == nullptr) continue;
    if (Status right = check(*update.surface); !right) return right;
  }
  std::vector<Change> changes;
  const auto give_up = [&] {
    memory_->discard();
    for (Change& change : changes) memory_->release(change.mesh.place);
  };
  try {
    Status done = put_all(surfaces, level, changes);
    if (!done) give_up();
    return done;
  } catch (...) {
    give_up();
    throw;
  }
}

Status MeshStore::put_all(std::span<const SurfaceUpdate> surfaces, int level, std::vector<Change>& changes) {
  std::size_t bytes = 0;
  Status done;
  for (const SurfaceUpdate& update : surfaces) {
    Change& change = changes.emplace_back(Change{{update.grid, level, update.content}, update.chunk, {}});
    if (update.surface != nullptr) done = upload(*update.surface, change.mesh);
    if (!done) return done;
    bytes += change.mesh.place.size;
    if (bytes < kBatchBytes) continue;
    if (done = finish(changes); !done) return done;
    bytes = 0;
  }
  return finish(changes);
}

Status MeshStore::upload(const ChunkSurface& surface, StoredMesh& mesh) {
  mesh.style = surface.style;
  QUOIN_ASSERT(mesh.place.size == 0, "a mesh without memory");
  std::vector<std::uint32_t> words;
  std::span<const std::byte> bytes;
  if (surface.style == SurfaceStyle::Blocky) {
    const std::span<const Quad> quads(surface.quads);
    set_directions(quads.first(surface.opaque_quads), mesh);
    const auto glass = quads.subspan(surface.opaque_quads);
    mesh.glass.assign(glass.begin(), glass.end());
    bytes = std::as_bytes(quads);
    if (!surface.shapes.empty()) {
      if (Status done = add_shapes(surface, words, mesh); !done) return done;
      bytes = std::as_bytes(std::span(words));
    }
    set_glass_types(mesh);
  } else {
    const SmoothChunkMesh& smooth = surface.smooth;
    mesh.indices = static_cast<std::uint32_t>(smooth.indices.size());
    mesh.glass_indices = static_cast<std::uint32_t>(surface.glass_indices);
    const std::size_t count = smooth.positions.size();
    words.reserve(kVertexWords * count + kMaterialWords * surface.materials.size() + smooth.indices.size());
    if (mesh.indices != 0) {
      for (std::size_t i = 0; i < count; ++i) append_vertex(surface, i, words);
      for (const VertexMaterials& each : surface.materials) append_materials(each, words);
      mesh.with_materials = static_cast<std::uint32_t>(surface.materials.size());
      QUOIN_ASSERT(surface.materials.size() < std::size_t{1} << (32 - kMeshVerticesShift), "a number of 28 bits");
    }
    mesh.first_index = words.size() * sizeof(std::uint32_t);
    words.insert(words.end(), smooth.indices.begin(), smooth.indices.end());
    bytes = std::as_bytes(std::span(words));
  }
  if (bytes.empty()) return {};
  const auto place = memory_->allocate(bytes.size(), "uploading meshes");
  if (!place) return place.error();
  mesh.place = *place;
  mesh.shapes.records += place->address;
  mesh.shapes.faces += place->address;
  return memory_->write(mesh.place, bytes);
}

namespace {

void append_words(std::span<const std::byte> bytes, std::size_t alignment, std::vector<std::uint32_t>& words) {
  QUOIN_ASSERT(bytes.size() % sizeof(std::uint32_t) == 0 && alignment % sizeof(std::uint32_t) == 0, "whole words");
  const std::size_t step = alignment / sizeof(std::uint32_t);
  const std::size_t first = (words.size() + step - 1) / step * step;
  words.resize(first + bytes.size() / sizeof(std::uint32_t));
  if (!bytes.empty()) std::memcpy(words.data() + first, bytes.data(), bytes.size());
}

std::uint64_t bytes_in(const std::vector<std::uint32_t>& words) {
  return words.size() * sizeof(std::uint32_t);
}

}  // namespace

// Writes quads, the faces of models that occur, each once, and the faces of shapes. Addresses count from the first one.
Status MeshStore::add_shapes(const ChunkSurface& surface, std::vector<std::uint32_t>& words, StoredMesh& mesh) {
  std::map<std::tuple<const ShapeModel*, std::uint16_t, bool>, std::size_t> known;
  std::vector<ShaderShapeRecord> records;
  std::vector<ShaderShapeFace> faces;
  faces.reserve(surface.shapes.size());
  StoredShapes& shapes = mesh.shapes;
  for (const ShapeFace& face : surface.shapes) {
    const bool is_transparent = faces.size() >= surface.opaque_shapes;
    const Texture* const texture = own_texture(face, is_transparent);
    const auto [record, is_new] = known.try_emplace({face.model, face.face, texture != nullptr}, records.size());
    if (is_new) {
      std::uint64_t texels = 0;
      if (texture != nullptr) {
        const auto address = send_texels(*memory_, *known_, *texture, shapes.texels);
        if (!address) return address.error();
        texels = *address;
      }
      records.push_back(shape_record(*face.model, face.face, texture, texels));
    }
    if (is_transparent) {
      if (const auto glass = glass_shape(face, faces.size())) shapes.glass.push_back(*glass);
    }
    faces.push_back(shader_face(face, record->second));
  }
  if (records.size() > kMaxShapeRecords) {
    return make_error(ErrorCode::LimitExceeded, "surface: more than 2,097,152 different faces of shapes in a chunk");
  }
  append_words(std::as_bytes(std::span(surface.quads)), sizeof(Quad), words);
  append_words(std::as_bytes(std::span(records)), ShaderMemory::kAlignment, words);
  shapes.records = bytes_in(words) - std::as_bytes(std::span(records)).size();
  append_words(std::as_bytes(std::span(faces)), sizeof(ShaderShapeFace), words);
  shapes.faces = bytes_in(words) - std::as_bytes(std::span(faces)).size();
  shapes.count = static_cast<std::uint32_t>(faces.size());
  shapes.opaque = static_cast<std::uint32_t>(surface.opaque_shapes);
  return {};
}

// Replaces the old surfaces by the new ones; keeps the old ones on failure.
Status MeshStore::finish(std::vector<Change>& changes) {
  Status done = memory_->flush();
  for (Change& change : changes) {
    if (done) {
      replace(change);
    } else {
      memory_->release(change.mesh.place);
    }
  }
  changes.clear();
  return done;
}

void MeshStore::replace(Change& change) {
  if (change.mesh.place.size == 0) {
    const auto grid = grids_.find(change.key);
    if (grid == grids_.end()) return;
    const auto old = grid->second.chunks.find(change.chunk);
    if (old == grid->second.chunks.end()) return;
    give_back(old->second);
    grid->second.chunks.erase(old);
    grid->second.bounds_known = false;
    if (grid->second.chunks.empty()) grids_.erase(grid);
    return;
  }
  StoredGrid& grid = grids_[change.key];
  const auto [at, is_new] = grid.chunks.try_emplace(change.chunk);
  grid.bounds_known = false;
  if (!is_new) give_back(at->second);
  at->second = std::move(change.mesh);
  ++chunks_;
  chunks_with_glass_ += at->second.has_glass() ? 1 : 0;
  triangles_ += at->second.triangles();
  bytes_ += at->second.place.size;
}

void MeshStore::give_back(StoredMesh& mesh) {
  QUOIN_ASSERT(chunks_ > 0 && bytes_ >= mesh.place.size && triangles_ >= mesh.triangles(),
               "removed meshes were counted");
  --chunks_;
  chunks_with_glass_ -= mesh.has_glass() ? 1 : 0;
  triangles_ -= mesh.triangles();
  bytes_ -= mesh.place.size;
  memory_->release(mesh.place);
}

void MeshStore::drop(MeshKey key) {
  const auto found = grids_.find(key);
  if (found == grids_.end()) return;
  for (auto& [at, mesh] : found->second.chunks) give_back(mesh);
  grids_.erase(found);
}

const MeshStore::StoredGrid* MeshStore::find(MeshKey key) {
  const auto found = grids_.find(key);
  if (found == grids_.end()) return nullptr;
  StoredGrid& grid = found->second;
  QUOIN_ASSERT(!grid.chunks.empty(), "grids without meshes are removed");
  if (!grid.bounds_known) {
    grid.low = grid.high = grid.chunks.begin()->first;
    grid.opaque_quads = 0;
    grid.bytes = 0;
    for (const auto& [at, mesh] : grid.chunks) {
      grid.low = glm::min(grid.low, at);
      grid.high = glm::max(grid.high, at);
      grid.opaque_quads += mesh.opaque.back() + mesh.shapes.opaque + mesh.indices / 6;
      grid.bytes += mesh.place.size;
    }
    grid.bounds_known = true;
  }
  return &grid;
}

namespace {

// Returns the types of halved grids. Their cells of shapes darken no corners, as in images of the CPU.
VoxelRegistry types_of_levels(const VoxelRegistry& types) {
  VoxelRegistry cubes = types_of_halved(types);
  for (std::size_t i = 0; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    if (!types.is_shaped(type) || !cubes.is_opaque(type)) continue;
    VoxelProperties cube = cubes[type];
    cube.occludes = false;
    cubes.replace(type, std::move(cube));
  }
  return cubes;
}

}  // namespace

void LevelMeshes::clear() {
  for (const auto& [key, level] : levels_) store_->drop(key);
  levels_.clear();
}

void LevelMeshes::look_at(const Scene& scene) {
  PendingChanges types(followed_types_, scene.types);
  const bool is_seen_otherwise = has_other_visibility(*types) || has_other_shapes(*types, scene.types);
  if (!types->empty()) cubes_.reset();
  for (auto level = levels_.begin(); level != levels_.end();) {
    const auto each = level++;
    if (scene.grids().find(each->first.grid) == nullptr) {
      drop(each);
    } else if (is_seen_otherwise || (!types->empty() && each->second.surfaces->style() == SurfaceStyle::Smooth)) {
      each->second.surfaces->forget();
    }
  }
  types.commit();
}

void LevelMeshes::drop(std::map<MeshKey, Level>::iterator level) {
  store_->drop(level->first);
  levels_.erase(level);
}

// Returns the style of the full grid's chunks, if there are any.
SurfaceStyle LevelMeshes::style_of(MeshKey key) {
  if (key.content == SurfaceContent::Field) return SurfaceStyle::Smooth;
  const MeshStore::StoredGrid* full = store_->find({key.grid, 0});
  return full == nullptr ? SurfaceStyle::Blocky : full->chunks.begin()->second.style;
}

Status LevelMeshes::put(MeshKey key, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads) {
  const SurfaceStyle style = style_of(key);
  auto known = levels_.find(key);
  if (known != levels_.end() && known->second.surfaces->style() != style) {
    drop(known);
    known = levels_.end();
  }
  if (known == levels_.end()) {
    known = levels_.emplace(key, Level{std::make_unique<GridSurfaces>(key.grid, key.content, style), 0}).first;
  }
  if (known->second.last_use == image_) return {};
  known->second.last_use = image_;
  try {
    Status done = put_updates(key, known->second, placed, types, threads);
    if (!done) drop(known);
    return done;
  } catch (...) {
    drop(known);
    throw;
  }
}

Status LevelMeshes::put_updates(MeshKey key, Level& level, const PlacedGrid& placed, const VoxelRegistry& types,
                                Threads threads) {
  SceneGrid content;
  if (key.content == SurfaceContent::Voxels) content.grid = placed.voxels->snapshot();
  if (key.content == SurfaceContent::Field && placed.field != nullptr) content.field = placed.field->field().snapshot();
  const bool has_shapes = key.content == SurfaceContent::Voxels && types.has_shapes();
  if (has_shapes && !cubes_) cubes_ = types_of_levels(types);
  const std::vector<SurfaceUpdate> updates = level.surfaces->update(content, has_shapes ? *cubes_ : types, threads);
  return updates.empty() ? Status{} : store_->put(updates, key.level);
}

void LevelMeshes::drop_unused(std::uint64_t max_bytes) {
  const auto bytes_of = [&](auto each) {
    const MeshStore::StoredGrid* stored = store_->find(each->first);
    return stored == nullptr ? 0 : stored->bytes;
  };
  std::uint64_t held = 0;
  for (auto each = levels_.begin(); each != levels_.end(); ++each) held += bytes_of(each);
  drop_oldest(
      levels_, held, max_bytes, [&](auto each) { return each->second.last_use != image_; }, bytes_of,
      [&](auto each) { drop(each); });
}

}  // namespace quoin::vulkan
