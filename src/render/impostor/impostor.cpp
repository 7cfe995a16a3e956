#include <quoin/render/impostor.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/trace/packet.h>

#include "render/impostor/impostor_surface.h"
#include "render/impostor/raster/impostor_faces.h"
#include "render/impostor/seen_faces.h"
#include "render/impostor/snapshot.h"
#include "render/impostor/surface_cells.h"
#include "render/light/corner_light.h"
#include "render/light/occlusion_directions.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

std::size_t ImpostorFaces::bytes() const {
  const auto of_level = [](const Level& level) {
    return level.views.size() * (3 * sizeof(float) + 2 * sizeof(std::uint32_t)) +
           (level.reach[0].size() + level.slope[0].size()) * 2 * sizeof(float) +
           level.groups.views.size() * (6 * sizeof(float) + sizeof(std::uint32_t)) + level.cells.size() * sizeof(Cell);
  };
  std::size_t sum = sizeof(*this) + faces.size() * sizeof(Face) + surfels.size() * sizeof(Surfel) +
                    shapes.size() * sizeof(ShapeSide) + of_level(unseen);
  for (const Level& level : levels) sum += of_level(level);
  return sum;
}

float openness_of(const ImpostorFaces::Face& face, OcclusionMode mode, DVec3 position) {
  if (face.in_field || (mode != OcclusionMode::Vertex && mode != OcclusionMode::Smooth))
    return static_cast<float>(face.open_rays) / ImpostorFaces::Face::kRays;
  if (face.occlusion == 0) return 1.0F;
  return 1.0F - occlusion_at(unpacked_corners(face.occlusion), face.voxel, face.direction, position) / 3.0F;
}

Impostor::Impostor() : faces_(std::make_shared<const ImpostorFaces>()) {}

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, const ImpostorOptions& options) {
  return build(grid, types, OccupancyTree::build(grid, types, Occupancy::Opaque), options);
}

std::size_t Impostor::bytes() const {
  return sizeof(*this) + faces_->bytes();
}

namespace {

constexpr std::int64_t kMaxVoxels = std::int64_t{1} << 26;  // of the box in which all faces are found at once

// Returns the texels per side: a texel is at most a voxel wide, within a memory limit.
int edge_for(const ContentSphere& content, const ImpostorOptions& options) {
  const double voxels = 2.0 * snapshot_camera(content, 0, options.edge).half_size();
  return voxels <= options.edge ? options.edge : 2 * options.edge;
}

// Returns the log2 of the width of cells whose bits are as wide as a snapshot's texels.
int first_width_for(const ContentSphere& content, int edge) {
  int log2_width = 2;
  while (log2_width < 10 && std::ldexp(edge, log2_width - 2) < 2.0 * content.radius) ++log2_width;
  return log2_width;
}

std::uint8_t packed(const FaceOcclusion& corners) {
  unsigned all = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    QUOIN_ASSERT(corners[i] < 4, "occlusion of 2 bits");
    all |= static_cast<unsigned>(corners[i]) << 2 * i;
  }
  return static_cast<std::uint8_t>(all);
}

constexpr double kOcclusionReach = LightOptions{}.occlusion_distance_voxels;

// Returns a point in front of a face, in the grid. `u` and `v`: -1 to 1 from one side of the face to the other.
DVec3 place_of(const ImpostorFaces& impostor, std::uint32_t index, double u = 0.0, double v = 0.0) {
  constexpr double kLift = 0.01;
  const ImpostorFaces::Face& face = impostor.faces[index];
  const FaceFrame& frame = frame_of(face.direction);
  if (!impostor.has_surfel(index)) {
    DVec3 place = DVec3(face.voxel) + 0.5 + (0.5 + kLift) * DVec3(normal_of(face.direction));
    place[frame.u] += 0.5 * u;
    place[frame.v] += 0.5 * v;
    return place;
  }
  const ImpostorFaces::Surfel& surfel = impostor.surfel_of(index);
  DVec3 place = surfel.middle(DVec3(face.voxel) + kLift * DVec3(surfel.normal), face.direction);
  u *= surfel.half[0], v *= surfel.half[1];
  place[frame.u] += u;
  place[frame.v] += v;
  place[frame.axis] += u * surfel.slope[0] + v * surfel.slope[1];
  return place;
}

// Returns true if a point lies inside a box of a shape.
bool is_inside(const ShapesAtVoxel& shapes, const DVec3& point) {
  return std::ranges::any_of(shapes, [&](const PlacedShape& shape) {
    return std::ranges::any_of(shape.model->boxes, [&](const ModelBox& box) {
      DVec3 at = point - DVec3(shape.voxel);
      if (box.is_turned) {
        const DVec3 from = at - DVec3(box.origin);
        for (int axis = 0; axis < 3; ++axis)
          at[axis] = glm::dot(DVec3(box.inverse[static_cast<std::size_t>(axis)]), from);
      }
      return glm::all(glm::greaterThan(at, DVec3(box.min))) && glm::all(glm::lessThan(at, DVec3(box.max)));
    });
  });
}

// Returns a mask; bit i is set if ray i meets a voxel, a shape or the field.
std::uint32_t blocked_by(const SolidVoxels& solid, const DensityTree* field, const RayPacket& rays) {
  const std::uint32_t blocked = solid.any_hits(rays);
  if (field == nullptr) return blocked;
  RayPacket rest = rays;
  rest.active &= ~blocked;
  return blocked | any_hits(*field, rest);
}

// Counts the occlusion rays of faces that reach open space, for up to sixteen faces at a time.
class OpenRays {
 public:
  OpenRays(const SolidVoxels& solid, const DensityTree* field, ImpostorFaces& impostor)
      : solid_(&solid), field_(field), impostor_(&impostor), directions_(kRays) {
    if (solid.shapes != nullptr) shapes_.emplace(solid.shapes->index);
    rays_.max_t.fill(kOcclusionReach);
  }

  void count(std::span<const std::uint32_t> faces) {
    QUOIN_ASSERT(faces.size() <= RayPacket::kSize, "a face per lane");
    place(faces);
    std::array<int, RayPacket::kSize> open{};
    std::array<int, RayPacket::kSize> counted{};
    for (int ray = 0; ray < kRays; ++ray) {
      aim(faces, ray);
      rays_.active = (1U << faces.size()) - 1U;
      if (before_shapes_ != 0) spread(faces, ray);
      const std::uint32_t blocked = blocked_by(*solid_, field_, rays_);
      for (std::size_t i = 0; i < faces.size(); ++i) {
        open[i] += static_cast<int>((rays_.active & ~blocked) >> i & 1U);
        counted[i] += static_cast<int>(rays_.active >> i & 1U);
      }
    }
    for (std::size_t i = 0; i < faces.size(); ++i) {
      QUOIN_ASSERT(open[i] <= counted[i] && counted[i] <= kRays, "at most all rays");
      const int of_all = counted[i] == 0 ? 0 : (2 * kRays * open[i] + counted[i]) / (2 * counted[i]);
      impostor_->faces[faces[i]].open_rays = static_cast<std::uint8_t>(of_all & 15);
    }
  }

 private:
  static constexpr int kRays = ImpostorFaces::Face::kRays;
  static_assert(kRays == 9, "a square of places");

  void place(std::span<const std::uint32_t> faces) {
    const ImpostorFaces::Face& first = impostor_->faces[faces[0]];
    before_shapes_ = 0;
    is_one_side_ = true;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const DVec3 origin = place_of(*impostor_, faces[i]);
      set_origin(origin, i);
      if (shapes_ && !shapes_->at(voxel_of(origin)).empty()) before_shapes_ |= 1U << i;
      is_one_side_ &= !impostor_->has_surfel(faces[i]) && impostor_->faces[faces[i]].direction == first.direction;
    }
  }

  void aim(std::span<const std::uint32_t> faces, int ray) {
    if (is_one_side_) {
      const auto side = static_cast<std::size_t>(impostor_->faces[faces[0]].direction);
      const DVec3 direction = directions_.fixed(side, ray);
      rays_.direction_x.fill(direction.x), rays_.direction_y.fill(direction.y), rays_.direction_z.fill(direction.z);
      return;
    }
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const ImpostorFaces::Face& face = impostor_->faces[faces[i]];
      // Faces of a field's surface and inclined sides of shapes use the values of an upper face, rotated with it.
      const bool is_inclined =
          impostor_->has_surfel(faces[i]) && (face.in_field || impostor_->surfel_of(faces[i]).is_inclined());
      DVec3 direction =
          directions_.fixed(static_cast<std::size_t>(is_inclined ? Direction::PosY : face.direction), ray);
      if (is_inclined) direction = turned_from_up(direction, DVec3(impostor_->surfel_of(faces[i]).normal));
      rays_.direction_x[i] = direction.x, rays_.direction_y[i] = direction.y, rays_.direction_z[i] = direction.z;
    }
  }

  // Shapes may cover the middles of the faces behind them: each ray starts at another place of such a face, and does
  // not count if that is inside a shape.
  void spread(std::span<const std::uint32_t> faces, int ray) {
    constexpr double kStep = 2.0 / 3.0;
    for (std::uint32_t left = before_shapes_; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      const DVec3 origin = place_of(*impostor_, faces[i], kStep * (ray % 3 - 1), kStep * (ray / 3 - 1));
      set_origin(origin, i);
      if (is_inside(shapes_->at(voxel_of(origin)), origin)) rays_.active &= ~(1U << i);
    }
  }

  void set_origin(const DVec3& origin, std::size_t lane) {
    rays_.origin_x[lane] = origin.x, rays_.origin_y[lane] = origin.y, rays_.origin_z[lane] = origin.z;
  }

  const SolidVoxels* solid_;
  const DensityTree* field_;
  ImpostorFaces* impostor_;
  OcclusionDirections directions_;
  std::optional<ShapeIndex::Reader> shapes_;
  RayPacket rays_;
  std::uint32_t before_shapes_ = 0;  // lanes of faces with shapes in front
  bool is_one_side_ = true;          // all faces are of voxels and have one direction
};

// Counts the open rays of each face at `wanted`; mostly of one direction.
void count_open_rays(const SolidVoxels& solid, const DensityTree* field, std::span<const std::uint32_t> wanted,
                     ImpostorFaces& impostor) {
  OpenRays rays(solid, field, impostor);
  for (std::size_t begin = 0; begin < wanted.size(); begin += RayPacket::kSize) {
    rays.count(wanted.subspan(begin, std::min<std::size_t>(RayPacket::kSize, wanted.size() - begin)));
  }
}

// The reusable faces of the previous impostor: faces without changes nearby.
class KnownFaces {
 public:
  KnownFaces() = default;
  KnownFaces(const ImpostorFaces& before, std::span<const IBox> changed) : faces_(before.faces) {
    // A voxel changes the light of all faces within reach of an occlusion ray.
    constexpr int kReach = static_cast<int>(kOcclusionReach) + 2;
    for (const IBox& box : changed) near_.push_back({box.min - kReach, box.max + kReach});
  }

  // Returns null if the face must be computed. Requires: faces are queried in list order.
  [[nodiscard]] const ImpostorFaces::Face* find(const ShellFace& face) {
    // The two lists mostly advance together.
    const auto next = [&] { return ShellFace{faces_[next_].voxel, faces_[next_].direction}; };
    while (next_ < faces_.size() && next() != face && comes_before(next(), face)) ++next_;
    if (next_ == faces_.size() || next() != face) return nullptr;
    const auto is_near = [&](const IBox& box) { return box.contains(face.voxel); };
    return std::any_of(near_.begin(), near_.end(), is_near) ? nullptr : &faces_[next_];
  }

 private:
  std::span<const ImpostorFaces::Face> faces_;
  std::vector<IBox> near_;
  std::size_t next_ = 0;
};

// The input for a grid's impostor.
struct Subject {
  SolidVoxels solid;
  const DensityTree* field;  // the opaque part of the grid's field; null: none
  ContentSphere content;
  IBox box;  // of the drawn content
  int edge = 0;
  int first_width = 0;                 // see ImpostorFaces
  std::optional<ImpostorShell> shell;  // none if there are too many faces
  SurfacePieces pieces;                // of field and shapes; those of shapes come later if there is no shell
  bool must_be_traced = false;

  Subject(const SolidVoxels& voxels, const DensityTree* of_field, const IBox& whole, const ImpostorOptions& options)
      : solid(voxels), field(of_field) {
    content = content_sphere(whole);
    box = unite(solid.bounds(), field == nullptr ? IBox{} : field->field().bounds());
    if (box.empty()) return;
    edge = edge_for(content, options);
    // Above this, one ray per texel takes less time.
    const std::int64_t max_faces = std::int64_t{kImpostorViews} * edge * edge;
    shell = ImpostorShell::build(*solid.opaque, kMaxVoxels, max_faces);
    if (shell) take_shapes(static_cast<std::size_t>(max_faces));
    if (!shell) first_width = first_width_for(content, edge);
    if (field == nullptr) return;
    auto found = surfels_of(field->field(), static_cast<std::size_t>(max_faces));
    must_be_traced = !shell || !found;
    if (!found) return;
    found->add(std::move(pieces));
    pieces = std::move(*found);
  }

  [[nodiscard]] bool occludes(IVec3 voxel, GridReader& reader) const {
    // The shell knows the voxels around its own; shapes may lie elsewhere.
    const IBox& known = solid.opaque->bounds();
    const bool is_outside = solid.shapes != nullptr && !IBox{known.min - 1, known.max + 1}.contains(voxel);
    if (!shell || is_outside || solid.types->has_unoccluding()) return solid.types->occludes(reader.get(voxel));
    return shell->is_occupied(voxel);
  }

 private:
  // Drops the shell if the shapes have too many pieces.
  void take_shapes(std::size_t max_pieces) {
    if (solid.shapes == nullptr) return;
    std::size_t count = 0;
    for (const IVec3 chunk : solid.shapes->index.chunks()) {
      solid.shapes->index.for_each_in(chunk, [&](const PlacedShape&) { ++count; });
    }
    if (count <= max_pieces) {
      pieces = pieces_of_shapes(*solid.shapes, *solid.grid, *solid.types, [](IVec3) { return true; });
    }
    if (std::max(count, pieces.faces.size()) <= max_pieces) return;
    pieces = {};
    shell.reset();
  }
};

// Returns all faces with the views that see them. Adds the pieces of shapes if rays find the faces.
BlockVector<SeenFace> faces_seen(Subject& subject) {
  if (subject.shell) {
    return faces_seen_of(*subject.shell, subject.pieces, subject.box, subject.content, subject.edge);
  }
  MetShapes met;
  BlockVector<SeenFace> seen = faces_seen_by_rays(subject.solid, subject.content, subject.edge, met);
  if (subject.solid.shapes == nullptr) return seen;
  subject.pieces = pieces_of_shapes(*subject.solid.shapes, *subject.solid.grid, *subject.solid.types,
                                    [&](IVec3 voxel) { return met.contains(voxel); });
  add_pieces_seen(subject.pieces, met, seen);
  return seen;
}

void put_faces(const Subject& subject, const BlockVector<SeenFace>& seen, KnownFaces known, ImpostorFaces& out) {
  GridReader reader(*subject.solid.grid);
  GridReader neighbours(*subject.solid.grid);
  std::vector<std::uint32_t> fresh;
  out.surfels = subject.pieces.surfels;
  out.shapes = subject.pieces.shapes;
  if (!out.shapes.empty()) out.types = *subject.solid.types;
  out.faces.reserve(seen.size());
  for (const SeenFace& each : seen) {
    ImpostorFaces::Face& face = out.faces.emplace_back();
    if (const ImpostorFaces::Face* same = known.find(each.face); same != nullptr) {
      face = *same;
      continue;
    }
    fresh.push_back(static_cast<std::uint32_t>(out.faces.size() - 1));
    face.voxel = each.face.voxel;
    face.direction = each.face.direction;
    if (each.surfel != nullptr) {
      const auto piece = static_cast<std::size_t>(each.surfel - subject.pieces.surfels.data());
      face.type = subject.pieces.types[piece];
      face.in_field = !each.in_shape;
      // Only sides of shapes that lie on a side of their voxel have corners of voxels.
      if (face.in_field || !subject.pieces.shapes[piece].on_side()) continue;
    } else {
      face.type = reader.get(face.voxel);
    }
    face.occlusion = packed(
        corner_occlusion([&](IVec3 voxel) { return subject.occludes(voxel, neighbours); }, face.voxel, face.direction));
  }
  QUOIN_ASSERT(out.faces.size() == seen.size() && out.surfels.size() <= seen.size(),
               "one entry per face, and its surfels last");
  count_open_rays(subject.solid, subject.field, fresh, out);
}

bool is_full(const OccupancyTree& tree, const IBox& box) {
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        if (!tree.is_occupied({x, y, z})) return false;
      }
    }
  }
  return true;
}

void put_levels(const Subject& subject, const BlockVector<SeenFace>& seen, ImpostorFaces& out) {
  const auto is_solid = [&](const IBox& box) {
    return subject.shell ? subject.shell->is_full(box) : is_full(*subject.solid.opaque, box);
  };
  std::size_t level = 0;
  int width = subject.first_width;  // log2
  if (width == 0) {
    out.levels[level++] = seen_faces(seen, subject.content);
    const auto in_field = [](const SeenFace& face) { return face.surfel != nullptr && !face.in_shape; };
    out.unseen =
        std::ranges::none_of(seen, in_field)
            ? unseen_faces(seen, subject.content)
            : SurfaceCells::behind(seen, subject.field->field(), subject.content, subject.edge).level(is_solid);
    ++width;
  }
  SurfaceCells cells(seen, subject.content, subject.edge, width);
  if (!subject.shell) cells.fill_from(*subject.solid.opaque);
  for (; level < out.levels.size(); ++level) {
    out.levels[level] = cells.level(is_solid);
    cells.halve();
  }
}

std::shared_ptr<const ImpostorFaces> faces_of(const Subject& subject, const BlockVector<SeenFace>& seen,
                                              KnownFaces known) {
  auto faces = std::make_shared<ImpostorFaces>();
  faces->edge = subject.edge;
  faces->is_whole = subject.shell.has_value() && subject.field == nullptr && subject.solid.shapes == nullptr;
  faces->centre = subject.content.centre;
  faces->first_width = subject.first_width;
  put_levels(subject, seen, *faces);
  put_faces(subject, seen, std::move(known), *faces);
  return faces;
}

// Returns true if a changed chunk has shapes.
bool adds_shapes(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) {
  if (!types.has_shapes()) return false;
  const std::vector<IVec3> chunks = changes.chunks(grid);
  return std::ranges::any_of(chunks, [&](IVec3 at) {
    const Chunk* const chunk = grid.find_chunk(at);
    return chunk != nullptr &&
           std::ranges::any_of(chunk->types(), [&](VoxelType type) { return types.is_shaped(type); });
  });
}

// Returns boxes around the changes if they are small enough for the remaining faces to be reused.
std::optional<std::vector<IBox>> small_boxes(const GridChanges& changes, const IBox& content) {
  constexpr std::size_t kMaxBoxes = 16;
  constexpr double kMaxShare = 1.0 / 16.0;  // of the content's volume
  if (changes.all || changes.items_unless_all().size() > kMaxBoxes) return std::nullopt;
  const auto volume = [](const IBox& box) {
    const DVec3 size = DVec3(box.max) - DVec3(box.min);
    return size.x * size.y * size.z;
  };
  std::vector<IBox> boxes;
  double sum = 0.0;
  for (const ChunkChange& change : changes.items_unless_all()) {
    const IVec3 corner = change.chunk * kChunkEdge;
    boxes.push_back({corner + change.box.min, corner + change.box.max});
    sum += volume(boxes.back());
  }
  if (sum > kMaxShare * volume(content)) return std::nullopt;
  return boxes;
}

}  // namespace

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                         const DensityTree* field, const IBox& whole, const ImpostorOptions& options) {
  QUOIN_ASSERT(options.edge >= 16 && options.edge <= 1024, "16 to 1,024 texels");
  TreeCache shaped(ShapedVoxels::ByShape);
  if (types.has_shapes()) shaped.update(grid, types);
  const SolidVoxels solid{&grid, &types, &opaque, shaped.shapes()};
  Subject subject(solid, field, unite(whole, solid.bounds()), options);
  Impostor made;
  made.options_ = options;
  made.content_ = subject.content;
  made.must_be_traced_ = subject.must_be_traced;
  if (made.must_be_traced_) return made;
  made.box_ = subject.box;
  if (made.empty()) return made;
  const BlockVector<SeenFace> seen = faces_seen(subject);
  if (seen.empty()) {  // only shapes of glass
    made.box_ = {};
    return made;
  }
  made.faces_ = faces_of(subject, seen, {});
  return made;
}

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                         const ImpostorOptions& options) {
  return build(grid, types, opaque, nullptr, grid.bounds(), options);
}

Impostor Impostor::build(const SceneGrid& grid, const VoxelRegistry& types, const ImpostorOptions& options) {
  const OccupancyTree opaque = OccupancyTree::build(grid.grid, types, Occupancy::Opaque);
  TreeCache trees;
  trees.update(grid.field, types);
  const IBox whole = unite(grid.grid.bounds(), grid.field.bounds());
  return build(grid.grid, types, opaque, trees.opaque_field(), whole, options);
}

Impostor Impostor::rebuilt(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) const {
  if (changes.empty()) return *this;
  QUOIN_ASSERT(faces_->surfels.size() == faces_->shapes.size(), "an impostor without a field");
  const OccupancyTree opaque = OccupancyTree::build(grid, types, Occupancy::Opaque);
  if (adds_shapes(grid, types, changes)) return build(grid, types, opaque, options_);
  const std::optional<std::vector<IBox>> changed = small_boxes(changes, opaque.bounds());
  const Subject subject({&grid, &types, &opaque}, nullptr, grid.bounds(), options_);
  const bool is_comparable = !empty() && changed && faces_->is_whole && subject.shell && subject.edge == faces_->edge &&
                             subject.content.centre == content_.centre && subject.content.radius == content_.radius;
  if (!is_comparable) return build(grid, types, opaque, options_);
  Impostor made;
  made.options_ = options_;
  made.content_ = content_;
  made.box_ = opaque.bounds();
  const BlockVector<SeenFace> seen = faces_seen_after(*faces_, *subject.shell, content_, *changed);
  made.faces_ = faces_of(subject, seen, KnownFaces(*faces_, *changed));
  return made;
}

}  // namespace quoin
