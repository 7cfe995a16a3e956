#include "render/impostor/seen_faces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <tsl/robin_map.h>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/trace/packet.h>

#include "render/impostor/raster/raster.h"
#include "render/impostor/snapshot.h"

namespace quoin {
namespace {

constexpr std::size_t kGroup = ImpostorFaces::kGroup;
constexpr std::size_t kSides = ImpostorFaces::kSides;

template <class ViewsOf>
ImpostorFaces::Level level_of(const BlockVector<SeenFace>& faces, const ContentSphere& content, ViewsOf views_of) {
  LevelMaker maker(content);
  maker.reserve(static_cast<std::size_t>(
      std::count_if(faces.begin(), faces.end(), [&](const SeenFace& face) { return views_of(face) != 0; })));
  const auto add = [&](std::size_t i) {
    const std::uint32_t views = views_of(faces[i]);
    if (views != 0) maker.add(rectangle_of(faces[i], content.centre), views, static_cast<std::uint32_t>(i));
  };
  const auto of_voxels =
      std::ranges::partition_point(faces, [](const SeenFace& face) { return face.surfel == nullptr; });
  const auto count = static_cast<std::size_t>(of_voxels - faces.begin());
  std::size_t voxel_face = 0;
  std::size_t piece = count;
  for (std::size_t side = 0; side < kSides; ++side) {
    const auto is_on = [&](const SeenFace& face) {
      return static_cast<std::size_t>(face.face.direction) + (face.is_inclined() ? kSides / 2 : 0) == side;
    };
    for (; piece < faces.size() && is_on(faces[piece]); ++piece) add(piece);
    for (; voxel_face < count && is_on(faces[voxel_face]); ++voxel_face) add(voxel_face);
  }
  return std::move(maker).level();
}

}  // namespace

Rectangle rectangle_of(const SeenFace& seen, DVec3 centre) {
  const auto [voxel, direction] = seen.face;
  const FaceFrame& frame = frame_of(direction);
  const ImpostorFaces::Surfel* const surfel = seen.surfel;
  Rectangle out;
  out.direction = direction;
  out.is_inclined = seen.is_inclined();
  for (std::size_t k = 0; surfel != nullptr && k < 2; ++k) {
    out.slope[k] = surfel->slope[k];
    out.reach[k] = surfel->half[k] + (seen.in_shape ? 0.0F : ImpostorFaces::kSurfelRoom);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_along = axis == frame.axis;
    const double of_voxel = is_along ? 0.5 + 0.5 * frame.sign : 0.5;
    const auto of_surfel = [&] { return is_along ? surfel->offset : surfel->shift[axis == frame.u ? 0 : 1]; };
    const double edge = surfel == nullptr ? of_voxel : double{of_surfel()};
    out.centre[axis] = static_cast<float>(voxel[axis] + edge - centre[axis]);
  }
  return out;
}

void LevelMaker::reserve(std::size_t count) {
  count += kSides * (kGroup - 1);
  for (BlockVector<float>& values : level_.centre) values.reserve(count);
  level_.views.reserve(count);
  level_.face.reserve(count);
}

void LevelMaker::add(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face) {
  QUOIN_ASSERT(views != 0 && rectangle.side() >= side_, "sides in their order");
  end_sides(rectangle.side());
  if (!has_reach_ && (rectangle.is_inclined || rectangle.reach != std::array{0.5F, 0.5F})) {
    has_reach_ = true;
    for (BlockVector<float>& values : level_.reach) values.assign(level_.views.size(), 0.5F);
  }
  if (!has_slope_ && rectangle.is_inclined) {
    has_slope_ = true;
    for (BlockVector<float>& values : level_.slope) values.assign(level_.views.size(), 0.0F);
  }
  put(rectangle, views, face);
}

void LevelMaker::put(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face) {
  const Vec3 half = rectangle.half_box();
  const bool is_first = level_.views.size() % kGroup == 0;
  low_ = is_first ? rectangle.centre - half : glm::min(low_, rectangle.centre - half);
  high_ = is_first ? rectangle.centre + half : glm::max(high_, rectangle.centre + half);
  for (std::size_t axis = 0; axis < 3; ++axis) level_.centre[axis].push_back(rectangle.centre[static_cast<int>(axis)]);
  level_.views.push_back(views);
  level_.face.push_back(face);
  for (std::size_t k = 0; k < 2; ++k) {
    if (has_reach_) level_.reach[k].push_back(rectangle.reach[k]);
    if (has_slope_) level_.slope[k].push_back(rectangle.slope[k]);
  }
  last_ = rectangle;
  if (level_.views.size() % kGroup == 0) end_group();
}

void LevelMaker::end_group() {
  ImpostorFaces::Groups& groups = level_.groups;
  QUOIN_ASSERT(!level_.views.empty() && level_.views.size() % kGroup == 0, "a full group");
  std::uint32_t views = 0;
  for (std::size_t i = level_.views.size() - kGroup; i < level_.views.size(); ++i) views |= level_.views[i];
  groups.views.push_back(views);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    groups.centre[axis].push_back(0.5F * (low_[a] + high_[a]));
    // Includes a rounding margin.
    groups.half[axis].push_back(0.5F * (high_[a] - low_[a]) + 1e-6F * level_.size);
  }
}

// Fills the last group with copies of its last rectangle that no view sees.
void LevelMaker::end_sides(std::size_t side) {
  for (; side_ < side; ++side_) {
    while (level_.views.size() % kGroup != 0) put(last_, 0, level_.face.back());
    level_.begin[side_ + 1] = static_cast<std::uint32_t>(level_.views.size());
  }
}

ImpostorFaces::Level LevelMaker::level() && {
  end_sides(kSides);
  QUOIN_ASSERT(level_.groups.views.size() * kGroup == level_.views.size(), "whole groups");
  QUOIN_ASSERT(level_.face.size() == level_.views.size(), "one face per rectangle");
  // Kernels read past the end.
  for (auto* const boxes : {&level_.groups.centre, &level_.groups.half}) {
    for (BlockVector<float>& values : *boxes) values.resize(values.size() + kGroup);
  }
  return std::move(level_);
}

ImpostorFaces::Level unseen_faces(const BlockVector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, [](const SeenFace& face) { return face.views == 0 ? kAllImpostorViews : 0U; });
}

ImpostorFaces::Level seen_faces(const BlockVector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, [](const SeenFace& face) { return face.views; });
}

ImpostorFaces::Level all_faces(const BlockVector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, [](const SeenFace&) { return kAllImpostorViews; });
}

namespace {

raster::Aim aim_of(const SnapshotCamera& camera) {
  raster::Aim aim;
  aim.right = camera.right, aim.down = -camera.up, aim.forward = camera.forward;
  aim.centre = {0.0, 0.0, camera.distance};
  aim.focal = camera.focal;
  return aim;
}

// Draws faces of a level into a snapshot, tile by tile; calls `visit(column, row, face)` for each texel of `area` that
// shows one.
template <class Visit>
void draw_texels(const ImpostorFaces::Level& level, std::uint32_t views, const SnapshotCamera& camera, int edge,
                 const TexelArea& area, raster::Canvas& canvas, Visit visit) {
  QUOIN_ASSERT(area.left >= 0 && area.right <= edge && area.top >= 0 && area.bottom <= edge, "texels of the snapshot");
  const raster::Aim aim = aim_of(camera);
  raster::Job job;
  job.level = &level;
  job.views = views;
  for (int row = 0; row < edge; row += raster::kTile) {
    for (int column = 0; column < edge; column += raster::kTile) {
      job.left = std::max(area.left - column, 0), job.right = std::min(area.right - column, raster::kTile);
      job.top = std::max(area.top - row, 0), job.bottom = std::min(area.bottom - row, raster::kTile);
      if (job.left >= job.right || job.top >= job.bottom) continue;
      canvas.clear();
      raster::set_aim(aim, column + 0.5 - 0.5 * edge, row + 0.5 - 0.5 * edge, job);
      raster::draw()(job, canvas);
      for (int y = job.top; y < job.bottom; ++y) {
        for (int x = job.left; x < job.right; ++x) {
          const std::size_t i = raster::index_of(x, y);
          if (!std::isinf(canvas.depth[i]))
            visit(column + x, row + y, raster::face_of(level, raster::Met::of(canvas.face[i])));
        }
      }
    }
  }
}

// Updates the faces of one view after an edit. A texel's face can only change where a changed voxel is visible. Within
// the texels of the changed boxes (`core`), the old and the new state are drawn. Every face visible there in either
// state gets its texels from a wider area (`around`), which contains all of them.
class SeenAgain {
 public:
  SeenAgain(const BlockVector<SeenFace>& old, BlockVector<SeenFace>& now, const std::vector<std::uint32_t>& now_of_old,
            const ContentSphere& content, int edge)
      : edge_(edge),
        content_(&content),
        old_level_(seen_faces(old, content)),
        now_level_(all_faces(now, content)),
        now_of_old_(&now_of_old),
        now_(&now),
        found_(now.size()) {}

  void take(int view, const IBox& changed) {
    QUOIN_ASSERT(view >= 0 && view < kImpostorViews, "one of the views");
    const SnapshotCamera camera = snapshot_camera(*content_, view, edge_);
    const TexelArea core = texels_of(camera, {changed.min - 1, changed.max + 1}, edge_);
    const TexelArea around = widened(core, camera);
    const std::uint32_t bit = 1U << view;
    draw_texels(old_level_, bit, camera, edge_, core, canvas_, [&](int, int, std::size_t face) {
      const std::uint32_t moved = (*now_of_old_)[face];
      if (moved != kGone) affected_.push_back(moved);
    });
    draw_texels(now_level_, ~0U, camera, edge_, around, canvas_, [&](int column, int row, std::size_t face) {
      found_[face] |= bit;
      shown_.push_back(static_cast<std::uint32_t>(face));
      if (column >= core.left && column < core.right && row >= core.top && row < core.bottom) {
        affected_.push_back(static_cast<std::uint32_t>(face));
      }
    });
    for (const std::uint32_t face : affected_) {
      std::uint32_t& views = (*now_)[face].views;
      views = (views & ~bit) | found_[face];
    }
    for (const std::uint32_t face : shown_) found_[face] = 0;
    shown_.clear();
    affected_.clear();
  }

  static constexpr std::uint32_t kGone = ~0U;

 private:
  // Widens an area by the maximum extent of a voxel face.
  [[nodiscard]] TexelArea widened(const TexelArea& area, const SnapshotCamera& camera) const {
    constexpr double kDiagonal = 1.7320508075688772;  // of a voxel
    const double texels = kDiagonal * camera.focal / (camera.distance - camera.reach);
    const int by = static_cast<int>(std::min(std::ceil(texels), static_cast<double>(edge_))) + 1;
    return {std::max(area.left - by, 0), std::max(area.top - by, 0), std::min(area.right + by, edge_),
            std::min(area.bottom + by, edge_)};
  }

  int edge_;
  const ContentSphere* content_;
  ImpostorFaces::Level old_level_;
  ImpostorFaces::Level now_level_;
  const std::vector<std::uint32_t>* now_of_old_;
  BlockVector<SeenFace>* now_;
  std::vector<std::uint32_t> found_;     // views by face; all 0 between calls
  std::vector<std::uint32_t> shown_;     // visible faces
  std::vector<std::uint32_t> affected_;  // may contain duplicates
  raster::Canvas canvas_;
};

// Requires: `faces` are whole.
BlockVector<SeenFace> seen_of(const ImpostorFaces& faces) {
  QUOIN_ASSERT(faces.is_whole, "complete faces");
  BlockVector<SeenFace> seen(faces.faces.size());
  for (std::size_t i = 0; i < seen.size(); ++i) seen[i].face = {faces.faces[i].voxel, faces.faces[i].direction};
  const ImpostorFaces::Level& from = faces.levels[0];
  for (std::size_t i = 0; i < from.views.size(); ++i) {
    if (from.views[i] != 0) seen[from.face[i]].views = from.views[i];
  }
  return seen;
}

// Returns the adjacent face across the edge towards `sign` along `axis`: in the same plane, or around the edge.
ShellFace face_beside(const ShellFace& face, int axis, int sign, const OccupancyTree& opaque) {
  IVec3 adjacent = face.voxel;
  adjacent[axis] += sign;
  const IVec3 front = adjacent + normal_of(face.direction);
  const auto towards = [&](int along) { return static_cast<Direction>(2 * axis + (along > 0 ? 0 : 1)); };
  if (opaque.is_occupied(front)) return {front, towards(-sign)};
  if (opaque.is_occupied(adjacent)) return {adjacent, face.direction};
  return {face.voxel, towards(sign)};
}

struct FaceHash {
  std::size_t operator()(const ShellFace& face) const {
    const auto bits = [](int coordinate) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(coordinate)); };
    std::uint64_t hash = bits(face.voxel.x) * 0x9E37'79B9'7F4A'7C15U;
    hash = (hash ^ bits(face.voxel.y)) * 0xC2B2'AE3D'27D4'EB4FU;
    hash = (hash ^ bits(face.voxel.z) ^ static_cast<std::uint64_t>(face.direction) << 40) * 0x9E37'79B9'7F4A'7C15U;
    return hash ^ hash >> 32;
  }
};

// Collects faces that rays meet.
class MetFaces {
 public:
  void take(const SolidVoxels& solid, const ContentSphere& content, int view, int edge, MetShapes& shapes) {
    const SnapshotCamera camera = snapshot_camera(content, view, edge);
    const TexelArea area = texels_of(camera, solid.bounds(), edge);
    PacketHits hits;
    RayPacket::Lanes<ShapeHit> in_shapes;
    for (int row = area.top; row < area.bottom; row += kTexelBlock) {
      for (int column = area.left; column < area.right; column += kTexelBlock) {
        const std::uint32_t of_shapes = solid.first_hits(rays_of_texels(camera, edge, column, row), hits, in_shapes);
        for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
          const int lane = std::countr_zero(left);
          const auto i = static_cast<std::size_t>(lane);
          if ((of_shapes >> lane & 1U) != 0) {
            shapes[in_shapes[i].voxel] |= 1U << view;
            continue;
          }
          SeenFace& seen = at({{hits.x[i], hits.y[i], hits.z[i]}, hits.face[i]});
          seen.views |= 1U << view;
        }
      }
    }
  }

  void add_neighbours(const OccupancyTree& opaque) {
    const BlockVector<SeenFace> found = faces_;
    for (const SeenFace& seen : found) {
      const FaceFrame& frame = frame_of(seen.face.direction);
      for (const int axis : {frame.u, frame.v}) {
        for (const int sign : {-1, 1}) at(face_beside(seen.face, axis, sign, opaque)).views |= seen.views;
      }
    }
  }

  BlockVector<SeenFace> faces() && { return std::move(faces_); }

 private:
  SeenFace& at(const ShellFace& face) {
    if (last_ < faces_.size() && faces_[last_].face == face) return faces_[last_];
    const auto [found, is_new] = index_.try_emplace(face, static_cast<std::uint32_t>(faces_.size()));
    if (is_new) faces_.push_back({face, nullptr, 0, false});
    last_ = found->second;
    return faces_[last_];
  }

  BlockVector<SeenFace> faces_;
  tsl::robin_map<ShellFace, std::uint32_t, FaceHash> index_;
  std::uint32_t last_ = 0;
};

// Returns all faces, not seen by any view.
BlockVector<SeenFace> unseen_of(const ImpostorShell& shell) {
  const BlockVector<ShellFace> all = shell.faces();
  BlockVector<SeenFace> faces(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) faces[i].face = all[i];
  return faces;
}

// Sorts faces by direction, then along a Morton curve, which keeps neighbours together.
BlockVector<SeenFace> sorted(const BlockVector<SeenFace>& faces, IVec3 least) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(faces.size());
  for (const SeenFace& seen : faces) {
    const IVec3 from_least = glm::min(seen.face.voxel - least, IVec3(0xF'FFFF));
    const std::uint64_t key = static_cast<std::uint64_t>(seen.face.direction) << 61 | morton_code(from_least);
    keys.emplace_back(key, static_cast<std::uint32_t>(keys.size()));
  }
  std::sort(keys.begin(), keys.end());
  BlockVector<SeenFace> out;
  out.reserve(faces.size());
  for (const auto& [key, i] : keys) out.push_back(faces[i]);
  return out;
}

}  // namespace

BlockVector<SeenFace> faces_seen_of(const ImpostorShell& shell, const SurfacePieces& pieces, const IBox& box,
                                    const ContentSphere& content, int edge) {
  QUOIN_ASSERT(pieces.surfels.size() == pieces.faces.size(), "one surfel per face");
  BlockVector<SeenFace> faces = unseen_of(shell);
  for (std::size_t i = 0; i < pieces.faces.size(); ++i) {
    faces.push_back({pieces.faces[i], &pieces.surfels[i], 0, pieces.in_shape(i)});
  }
  const ImpostorFaces::Level level = all_faces(faces, content);
  raster::Canvas canvas;
  for (int view = 0; view < kImpostorViews; ++view) {
    const SnapshotCamera camera = snapshot_camera(content, view, edge);
    draw_texels(level, ~0U, camera, edge, texels_of(camera, box, edge), canvas,
                [&](int, int, std::size_t face) { faces[face].views |= 1U << view; });
  }
  return faces;
}

BlockVector<SeenFace> faces_seen_after(const ImpostorFaces& before, const ImpostorShell& shell,
                                       const ContentSphere& content, std::span<const IBox> changed) {
  const BlockVector<SeenFace> old = seen_of(before);
  BlockVector<SeenFace> now = unseen_of(shell);
  std::vector<std::uint32_t> now_of_old(old.size(), SeenAgain::kGone);
  std::size_t next = 0;
  for (std::size_t i = 0; i < old.size(); ++i) {
    // The two lists mostly advance together.
    const ShellFace& face = old[i].face;
    while (next < now.size() && now[next].face != face && comes_before(now[next].face, face)) ++next;
    if (next == now.size()) break;
    if (now[next].face != face) continue;
    now[next].views = old[i].views;
    now_of_old[i] = static_cast<std::uint32_t>(next);
  }
  SeenAgain again(old, now, now_of_old, content, before.edge);
  for (int view = 0; view < kImpostorViews; ++view) {
    for (const IBox& box : changed) again.take(view, box);
  }
  return now;
}

BlockVector<SeenFace> faces_seen_by_rays(const SolidVoxels& solid, const ContentSphere& content, int edge,
                                         MetShapes& shapes) {
  MetFaces met;
  for (int view = 0; view < kImpostorViews; ++view) met.take(solid, content, view, edge, shapes);
  met.add_neighbours(*solid.opaque);
  return sorted(std::move(met).faces(), solid.opaque->bounds().min);
}

void add_pieces_seen(const SurfacePieces& pieces, const MetShapes& met, BlockVector<SeenFace>& faces) {
  for (std::size_t i = 0; i < pieces.faces.size(); ++i) {
    const auto found = met.find(pieces.faces[i].voxel);
    QUOIN_ASSERT(found != met.end(), "pieces of shapes that rays met");
    std::uint32_t views = 0;
    for (std::uint32_t left = found->second; left != 0; left &= left - 1) {
      const int view = std::countr_zero(left);
      if (glm::dot(impostor_view(view), DVec3(pieces.surfels[i].normal)) > 0.0) views |= 1U << view;
    }
    faces.push_back({pieces.faces[i], &pieces.surfels[i], views, true});
  }
}

}  // namespace quoin
