// The sides of shapes as pieces of an impostor's surface.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_shape.h>

#include "render/impostor/impostor_surface.h"
#include "scene/tracer/shape_rays.h"

namespace quoin {
namespace {

// A piece of a model's side, relative to the shape's voxel.
struct Piece {
  std::int16_t face = 0;
  Direction direction = Direction::PosX;
  ImpostorFaces::Surfel surfel;
};

// The part of a side that hides the background.
enum class Seen : std::uint8_t { Nothing, Whole, Texels };

// A rectangle along the axes u and v of a direction, in cells.
struct Cells {
  int first = 0;
  int end = 0;
  int top = 0;
  int bottom = 0;
};

// A side of a model in the plane of its direction's axes u and v, seen from the front or from behind.
class FlatSide {
 public:
  FlatSide(const ModelFace& face, bool is_from_behind)
      : face_(&face),
        normal_(is_from_behind ? -face.normal : face.normal),
        direction_(is_from_behind ? opposite(face.direction) : face.direction),
        frame_(&frame_of(direction_)),
        low_(face.corners[0]),
        high_(face.corners[0]) {
    for (const Vec3& corner : face.corners) {
      low_ = glm::min(low_, corner);
      high_ = glm::max(high_, corner);
    }
  }

  [[nodiscard]] Direction direction() const { return direction_; }
  [[nodiscard]] float extent(int i) const { return (high_ - low_)[axis_of(i)]; }
  // Returns the length of the side along u or v, measured on its plane.
  [[nodiscard]] float length(int i) const {
    const float slope = slopes()[static_cast<std::size_t>(i)];
    return extent(i) * std::sqrt(1.0F + slope * slope);
  }
  [[nodiscard]] bool is_rectangle() const {
    float twice_area = 0.0F;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3& from = face_->corners[i];
      const Vec3& to = face_->corners[(i + 1) % 4];
      twice_area += from[frame_->u] * to[frame_->v] - to[frame_->u] * from[frame_->v];
    }
    const float of_box = 2.0F * extent(0) * extent(1);
    return std::abs(std::abs(twice_area) - of_box) <= 1e-3F * of_box;
  }
  // Returns the point of the side's plane at a share of its extents along u and v.
  [[nodiscard]] Vec3 point(float share_u, float share_v) const {
    Vec3 point = low_;
    point[frame_->u] += share_u * extent(0);
    point[frame_->v] += share_v * extent(1);
    const Vec3& on = face_->corners[0];
    const auto slope = slopes();
    point[frame_->axis] = on[frame_->axis] + slope[0] * (point[frame_->u] - on[frame_->u]) +
                          slope[1] * (point[frame_->v] - on[frame_->v]);
    return point;
  }
  // Returns true if a point of the plane lies on the side, whose corners may be in either order.
  [[nodiscard]] bool contains(const Vec3& point) const {
    bool is_left = true;
    bool is_right = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3& from = face_->corners[i];
      const Vec3 along = face_->corners[(i + 1) % 4] - from;
      const Vec3 to = point - from;
      const float turn = along[frame_->u] * to[frame_->v] - along[frame_->v] * to[frame_->u];
      is_left = is_left && turn >= 0.0F;
      is_right = is_right && turn <= 0.0F;
    }
    return is_left || is_right;
  }
  // Returns the piece between two shares of the extents along u and v.
  [[nodiscard]] ImpostorFaces::Surfel piece(std::array<float, 2> from, std::array<float, 2> to) const {
    const Vec3 middle = point(0.5F * (from[0] + to[0]), 0.5F * (from[1] + to[1]));
    ImpostorFaces::Surfel surfel;
    surfel.normal = normal_;
    surfel.offset = middle[frame_->axis];
    surfel.slope = slopes();
    for (int i = 0; i < 2; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const float half = 0.5F * (to[k] - from[k]) * extent(i);
      surfel.half[k] = surfel.is_inclined() ? std::round(1024.0F * half) / 1024.0F : half;
      surfel.shift[k] = middle[axis_of(i)];
    }
    return surfel;
  }

 private:
  [[nodiscard]] int axis_of(int i) const { return static_cast<int>(i == 0 ? frame_->u : frame_->v); }
  [[nodiscard]] std::array<float, 2> slopes() const {
    if (normal_ == Vec3(normal_of(direction_))) return {};
    return {-normal_[frame_->u] / normal_[frame_->axis], -normal_[frame_->v] / normal_[frame_->axis]};
  }

  const ModelFace* face_;
  Vec3 normal_;
  Direction direction_;
  const FaceFrame* frame_;
  Vec3 low_;
  Vec3 high_;
};

// Cuts the sides of a model.
class ModelCutter {
 public:
  ModelCutter(const VoxelProperties& type, const ShapeModel& model) : type_(&type), model_(&model) {}

  [[nodiscard]] std::vector<Piece> pieces() && {
    for (const ModelBox& box : model_->boxes) cut_box(box);
    for (std::size_t i = model_->faces.size() - model_->free_faces; i < model_->faces.size(); ++i) cut(i, false);
    return std::move(pieces_);
  }

 private:
  // As ShapeParts::Visible.
  [[nodiscard]] Seen seen_of(const ModelFace& face) const {
    if (type_->visibility == Visibility::Opaque) return Seen::Whole;
    const VoxelFace* const look = look_of(*model_, face, type_->faces);
    if (look == nullptr || look->texture.is_null() || look->alpha == FaceAlpha::Translucent) return Seen::Nothing;
    return look->alpha == FaceAlpha::Opaque ? Seen::Whole : Seen::Texels;
  }

  void cut_box(const ModelBox& box) {
    const auto is_whole = [&](std::int16_t i) {
      return i >= 0 && seen_of(model_->faces[static_cast<std::size_t>(i)]) == Seen::Whole;
    };
    const bool is_closed = std::ranges::all_of(box.faces, is_whole);
    const bool is_plate = box.min.x == box.max.x || box.min.y == box.max.y || box.min.z == box.max.z;
    for (const Direction direction : kDirections) {
      const std::int16_t face = box.faces[static_cast<std::size_t>(direction)];
      if (face < 0 || model_->faces[static_cast<std::size_t>(face)].is_inner) continue;
      cut(static_cast<std::size_t>(face), false);
      // A plate has its other side in front of the back of this one.
      const bool has_back = box.faces[static_cast<std::size_t>(opposite(direction))] >= 0;
      if (is_plate ? !has_back : !is_closed) cut(static_cast<std::size_t>(face), true);
    }
  }

  void cut(std::size_t number, bool is_from_behind) {
    const ModelFace& face = model_->faces[number];
    const Seen seen = seen_of(face);
    if (seen == Seen::Nothing || face.normal == Vec3(0.0F)) return;
    const FlatSide side(face, is_from_behind);
    if (!(side.extent(0) > 0.0F && side.extent(1) > 0.0F)) return;
    if (seen == Seen::Whole && side.is_rectangle()) {
      put(number, side, {0.0F, 0.0F}, {1.0F, 1.0F});
      return;
    }
    const int columns = cells_along(side.length(0));
    const int rows = cells_along(side.length(1));
    const auto share = [](int i, int count) { return static_cast<float>(i) / static_cast<float>(count); };
    for (const Cells& area : merged(side, face, seen, columns, rows)) {
      put(number, side, {share(area.first, columns), share(area.top, rows)},
          {share(area.end, columns), share(area.bottom, rows)});
    }
  }

  static int cells_along(float length) {
    return std::max(1, static_cast<int>(std::ceil(length * static_cast<float>(kShapeUnits) - 1e-2F)));
  }

  // Returns the visible cells of a side as rectangles: runs of rows, joined where they are the same in the next row.
  [[nodiscard]] std::vector<Cells> merged(const FlatSide& side, const ModelFace& face, Seen seen, int columns,
                                          int rows) const {
    const VoxelFace* const look = look_of(*model_, face, type_->faces);
    const auto is_seen = [&](int column, int row) {
      const Vec3 middle = side.point((static_cast<float>(column) + 0.5F) / static_cast<float>(columns),
                                     (static_cast<float>(row) + 0.5F) / static_cast<float>(rows));
      if (!side.contains(middle)) return false;
      return seen == Seen::Whole || shape_texel(face, *look, DVec3(middle)).a >= kCutoutAlpha;
    };
    std::vector<Cells> areas;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        if (!is_seen(column, row)) continue;
        const int first = column;
        while (column < columns && is_seen(column, row)) ++column;
        const auto above = std::ranges::find_if(
            areas, [&](const Cells& area) { return area.bottom == row && area.first == first && area.end == column; });
        if (above != areas.end()) {
          ++above->bottom;
        } else {
          areas.push_back({first, column, row, row + 1});
        }
      }
    }
    return areas;
  }

  void put(std::size_t number, const FlatSide& side, std::array<float, 2> from, std::array<float, 2> to) {
    pieces_.push_back({static_cast<std::int16_t>(number), side.direction(), side.piece(from, to)});
  }

  const VoxelProperties* type_;
  const ShapeModel* model_;
  std::vector<Piece> pieces_;
};

// Finds sides of a shape that its neighbours cover.
class CoveredSides {
 public:
  CoveredSides(const Grid& grid, const VoxelRegistry& types) : grid_(&grid), types_(&types), reader_(grid) {}

  [[nodiscard]] bool has(const PlacedShape& shape, const ModelFace& face) {
    if (!face.on_side) return false;
    const IVec3 at = shape.voxel + normal_of(face.direction);
    const VoxelType neighbour = reader_.get(at);
    if (neighbour == kAir) return false;
    const ShapeModel* const model = types_->is_shaped(neighbour) ? shape_at(*grid_, *types_, at) : nullptr;
    return covers(*types_, neighbour, model, shape.type, face.direction, face.mask);
  }

 private:
  const Grid* grid_;
  const VoxelRegistry* types_;
  GridReader reader_;
};

}  // namespace

SurfacePieces pieces_of_shapes(const TracedShapes& shapes, const Grid& grid, const VoxelRegistry& types,
                               FunctionRef<bool(IVec3 voxel)> is_wanted) {
  std::map<std::pair<VoxelType, const ShapeModel*>, std::vector<Piece>> known;
  CoveredSides covered(grid, types);
  SurfacePieces out;
  const auto add = [&](const PlacedShape& shape) {
    if (!is_wanted(shape.voxel)) return;
    const auto [found, is_new] = known.try_emplace({shape.type, shape.model});
    if (is_new) found->second = ModelCutter(types[shape.type], *shape.model).pieces();
    std::int16_t last = -1;
    bool is_covered = false;
    for (const Piece& piece : found->second) {
      if (piece.face != std::exchange(last, piece.face)) {
        is_covered = covered.has(shape, shape.model->faces[static_cast<std::size_t>(piece.face)]);
      }
      if (is_covered) continue;
      out.faces.push_back({shape.voxel, piece.direction});
      out.surfels.push_back(piece.surfel);
      out.types.push_back(shape.type);
      out.shapes.push_back({shape.model, piece.face});
    }
  };
  for (const IVec3 chunk : shapes.index.chunks()) shapes.index.for_each_in(chunk, add);
  out.sort();
  return out;
}

}  // namespace quoin
