#include <quoin/render/impostor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

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
  std::size_t sum = sizeof(*this) + faces.size() * sizeof(Face) + surfels.size() * sizeof(Surfel) + of_level(unseen);
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

// Returns a point in front of a surfel's middle, in the grid.
DVec3 place_of(const ImpostorFaces::Face& face, const ImpostorFaces::Surfel& surfel, double lift) {
  return surfel.middle(DVec3(face.voxel) + lift * DVec3(surfel.normal), face.direction);
}

// Returns a mask; bit i is set if ray i meets a voxel or the field.
std::uint32_t blocked_by(const OccupancyTree& opaque, const DensityTree* field, const RayPacket& rays) {
  const std::uint32_t blocked = any_hits(opaque, rays);
  if (field == nullptr) return blocked;
  RayPacket rest = rays;
  rest.active &= ~blocked;
  return blocked | any_hits(*field, rest);
}

// Sets the directions of one of the occlusion rays of each face at `wanted`.
void set_directions(const OcclusionDirections& directions, int ray, std::span<const std::uint32_t> wanted,
                    const ImpostorFaces& impostor, RayPacket& rays) {
  QUOIN_ASSERT(wanted.size() <= RayPacket::kSize, "a face per lane");
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const ImpostorFaces::Face& face = impostor.faces[wanted[i]];
    // Faces of a field's surface use the values of an upper face, rotated with it.
    const auto side = static_cast<std::size_t>(face.in_field ? Direction::PosY : face.direction);
    DVec3 direction = directions.fixed(side, ray);
    if (face.in_field) direction = turned_from_up(direction, DVec3(impostor.surfel_of(wanted[i]).normal));
    rays.direction_x[i] = direction.x, rays.direction_y[i] = direction.y, rays.direction_z[i] = direction.z;
  }
}

// Counts the rays of OcclusionDirections that reach open space from the middle of each face at `wanted`. Handles
// sixteen faces at a time, mostly of one direction.
void count_open_rays(const OccupancyTree& opaque, const DensityTree* field, std::span<const std::uint32_t> wanted,
                     ImpostorFaces& impostor) {
  BlockVector<ImpostorFaces::Face>& faces = impostor.faces;
  constexpr double kLift = 0.01;
  constexpr int kRays = ImpostorFaces::Face::kRays;
  const OcclusionDirections directions(kRays);
  RayPacket rays;
  rays.max_t.fill(kOcclusionReach);
  for (std::size_t begin = 0; begin < wanted.size(); begin += RayPacket::kSize) {
    const std::size_t size = std::min<std::size_t>(RayPacket::kSize, wanted.size() - begin);
    rays.active = (1U << size) - 1U;
    for (std::size_t i = 0; i < size; ++i) {
      const ImpostorFaces::Face& face = faces[wanted[begin + i]];
      const DVec3 origin = face.in_field ? place_of(face, impostor.surfel_of(wanted[begin + i]), kLift)
                                         : DVec3(face.voxel) + 0.5 + (0.5 + kLift) * DVec3(normal_of(face.direction));
      rays.origin_x[i] = origin.x, rays.origin_y[i] = origin.y, rays.origin_z[i] = origin.z;
    }
    const ImpostorFaces::Face& first = faces[wanted[begin]];
    const bool is_one_side = std::ranges::all_of(wanted.subspan(begin, size), [&](std::uint32_t i) {
      return !faces[i].in_field && faces[i].direction == first.direction;
    });
    std::array<int, RayPacket::kSize> open{};
    for (int ray = 0; ray < kRays; ++ray) {
      if (is_one_side) {
        const DVec3 direction = directions.fixed(static_cast<std::size_t>(first.direction), ray);
        rays.direction_x.fill(direction.x), rays.direction_y.fill(direction.y), rays.direction_z.fill(direction.z);
      } else {
        set_directions(directions, ray, wanted.subspan(begin, size), impostor, rays);
      }
      const std::uint32_t blocked = blocked_by(opaque, field, rays);
      for (std::size_t i = 0; i < size; ++i) open[i] += (blocked >> i & 1U) == 0;
    }
    for (std::size_t i = 0; i < size; ++i) {
      QUOIN_ASSERT(open[i] >= 0 && open[i] <= kRays, "at most all rays");
      faces[wanted[begin + i]].open_rays = static_cast<std::uint8_t>(open[i] & 15);
    }
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
  const Grid* grid;
  const VoxelRegistry* types;
  const OccupancyTree* opaque;
  const DensityTree* field;  // the opaque part of the grid's field; null: none
  ContentSphere content;
  IBox box;  // of the drawn content
  int edge = 0;
  int first_width = 0;                 // see ImpostorFaces
  std::optional<ImpostorShell> shell;  // none if there are too many faces
  FieldSurfels surfels;
  bool must_be_traced = false;

  Subject(const Grid& of_grid, const VoxelRegistry& of_types, const OccupancyTree& tree, const DensityTree* of_field,
          const IBox& whole, const ImpostorOptions& options)
      : grid(&of_grid), types(&of_types), opaque(&tree), field(of_field) {
    content = content_sphere(whole);
    box = unite(tree.bounds(), field == nullptr ? IBox{} : field->field().bounds());
    if (box.empty()) return;
    edge = edge_for(content, options);
    // Above this, one ray per texel takes less time.
    const std::int64_t max_faces = std::int64_t{kImpostorViews} * edge * edge;
    shell = ImpostorShell::build(tree, kMaxVoxels, max_faces);
    if (!shell) first_width = first_width_for(content, edge);
    if (field == nullptr) return;
    auto found = surfels_of(field->field(), static_cast<std::size_t>(max_faces));
    must_be_traced = !shell || !found;
    if (found) surfels = std::move(*found);
  }

  [[nodiscard]] bool occludes(IVec3 voxel, GridReader& reader) const {
    if (!shell || types->has_unoccluding()) return types->occludes(reader.get(voxel));
    return shell->is_occupied(voxel);
  }
};

void put_faces(const Subject& subject, const BlockVector<SeenFace>& seen, KnownFaces known, ImpostorFaces& out) {
  GridReader reader(*subject.grid);
  GridReader neighbours(*subject.grid);
  std::vector<std::uint32_t> fresh;
  out.surfels = subject.surfels.surfels;
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
      face.in_field = true;
      face.type = subject.surfels.types[static_cast<std::size_t>(each.surfel - subject.surfels.surfels.data())];
      continue;
    }
    face.type = reader.get(face.voxel);
    face.occlusion = packed(
        corner_occlusion([&](IVec3 voxel) { return subject.occludes(voxel, neighbours); }, face.voxel, face.direction));
  }
  QUOIN_ASSERT(out.faces.size() == seen.size() && out.surfels.size() <= seen.size(),
               "one entry per face, and its surfels last");
  count_open_rays(*subject.opaque, subject.field, fresh, out);
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
    return subject.shell ? subject.shell->is_full(box) : is_full(*subject.opaque, box);
  };
  std::size_t level = 0;
  int width = subject.first_width;  // log2
  if (width == 0) {
    out.levels[level++] = seen_faces(seen, subject.content);
    out.unseen =
        subject.surfels.surfels.empty()
            ? unseen_faces(seen, subject.content)
            : SurfaceCells::behind(seen, subject.field->field(), subject.content, subject.edge).level(is_solid);
    ++width;
  }
  SurfaceCells cells(seen, subject.content, subject.edge, width);
  if (!subject.shell) cells.fill_from(*subject.opaque);
  for (; level < out.levels.size(); ++level) {
    out.levels[level] = cells.level(is_solid);
    cells.halve();
  }
}

std::shared_ptr<const ImpostorFaces> faces_of(const Subject& subject, const BlockVector<SeenFace>& seen,
                                              KnownFaces known) {
  auto faces = std::make_shared<ImpostorFaces>();
  faces->edge = subject.edge;
  faces->is_whole = subject.shell.has_value() && subject.field == nullptr;
  faces->centre = subject.content.centre;
  faces->first_width = subject.first_width;
  put_levels(subject, seen, *faces);
  put_faces(subject, seen, std::move(known), *faces);
  return faces;
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
  const Subject subject(grid, types, opaque, field, whole, options);
  Impostor made;
  made.options_ = options;
  made.content_ = subject.content;
  made.must_be_traced_ = subject.must_be_traced;
  if (made.must_be_traced_) return made;
  made.box_ = subject.box;
  if (made.empty()) return made;
  const BlockVector<SeenFace> seen =
      subject.shell ? faces_seen_of(*subject.shell, subject.surfels, made.box_, subject.content, subject.edge)
                    : faces_seen_by_rays(opaque, subject.content, subject.edge);
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
  QUOIN_ASSERT(faces_->surfels.empty(), "an impostor without a field");
  const OccupancyTree opaque = OccupancyTree::build(grid, types, Occupancy::Opaque);
  const std::optional<std::vector<IBox>> changed = small_boxes(changes, opaque.bounds());
  const Subject subject(grid, types, opaque, nullptr, grid.bounds(), options_);
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
