#include "render/path/path_lamps.h"

#include <bit>
#include <limits>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/mesh/blocky.h>

#include "core/coordinates/chunk_order.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::path {
namespace {

constexpr double kPiDouble = std::numbers::pi;

// A lamp that looks smaller than this from a point is sampled by area instead of solid angle, because its distance
// hardly varies.
constexpr float kSmallLamp = 0.01F;

// A rectangle as seen from a point in front of it. Source: C. Ureña, M. Fajardo, A. King, "An
// area-preserving parametrization for spherical rectangles" (2013).
class SphericalRectangle {
 public:
  SphericalRectangle(const PathLamp& lamp, Vec3 to_corner)
      : x0_(glm::dot(to_corner, lamp.u)),
        y0_(glm::dot(to_corner, lamp.v)),
        z0_(glm::dot(to_corner, lamp.normal)),
        x1_(x0_ + lamp.size_u),
        y1_(y0_ + lamp.size_v) {
    const auto low_of = [&](double place) { return place / std::sqrt(z0_ * z0_ + place * place); };
    b0_ = -low_of(y0_);
    b1_ = low_of(y1_);
    const double right = low_of(x1_);
    const double left = -low_of(x0_);
    const double g0 = arc_cosine(-b0_ * right);
    const double g1 = arc_cosine(-right * b1_);
    const double g2 = arc_cosine(-b1_ * left);
    const double g3 = arc_cosine(-left * b0_);
    turn_ = 2.0 * kPiDouble - g2 - g3;
    solid_angle_ = std::max(g0 + g1 - turn_, 0.0);
  }

  [[nodiscard]] double solid_angle() const { return solid_angle_; }

  // Returns a point of the rectangle relative to the viewer, along the lamp's u, v and normal.
  [[nodiscard]] DVec3 sample(Pair u) const {
    const double angle = u.x * solid_angle_ + turn_;
    double turns = angle / (2.0 * kPiDouble);
    turns -= std::floor(turns);
    const SineCosine of_angle = of_turns(static_cast<float>(turns));
    const double sine = of_angle.sine;
    const double f = (of_angle.cosine * b0_ - b1_) / (sine != 0.0 ? sine : 1e-12);
    const double c = std::clamp((f > 0.0 ? 1.0 : -1.0) / std::sqrt(f * f + b0_ * b0_), -1.0 + 1e-12, 1.0 - 1e-12);
    const double x = std::clamp(-(c * -std::abs(z0_)) / std::sqrt(1.0 - c * c), x0_, x1_);
    const double d = std::sqrt(x * x + z0_ * z0_);
    const double h0 = y0_ / std::sqrt(d * d + y0_ * y0_);
    const double h1 = y1_ / std::sqrt(d * d + y1_ * y1_);
    const double h = h0 + u.y * (h1 - h0);
    const double y = h * h < 1.0 - 1e-9 ? std::clamp(h * d / std::sqrt(1.0 - h * h), y0_, y1_) : (h > 0.0 ? y1_ : y0_);
    return {x, y, z0_};
  }

 private:
  double x0_, y0_, z0_, x1_, y1_;
  double b0_ = 0.0, b1_ = 0.0;
  double turn_ = 0.0;
  double solid_angle_ = 0.0;
};

// A point's view of a rectangle.
struct Seen {
  Vec3 to_corner;
  bool is_before = false;
  bool is_small = false;
};

Seen seen_from(const PathLamp& lamp, DVec3 point) {
  Seen seen;
  seen.to_corner = Vec3(lamp.corner - point);
  seen.is_before = glm::dot(seen.to_corner, lamp.normal) < 0.0F;
  const Vec3 to_middle = seen.to_corner + lamp.u * (0.5F * lamp.size_u) + lamp.v * (0.5F * lamp.size_v);
  const float longest = std::max(lamp.size_u, lamp.size_v);
  seen.is_small = longest * longest < kSmallLamp * glm::dot(to_middle, to_middle);
  return seen;
}

// Returns the density of a rectangle sampled by solid angle.
float density_of(const SphericalRectangle& seen) {
  const double angle = seen.solid_angle();
  return angle > 0.0 ? static_cast<float>(1.0 / angle) : 0.0F;
}

// Returns the density of a small lamp, sampled by area.
float density_of(const PathLamp& lamp, Vec3 direction, float distance) {
  const float cosine = -glm::dot(direction, lamp.normal);
  return cosine > 0.0F ? distance * distance / (cosine * lamp.size_u * lamp.size_v) : 0.0F;
}

LampSample sample_point_lamp(const PathLamp& lamp, DVec3 point) {
  QUOIN_ASSERT(lamp.is_point, "a lamp without a body");
  LampSample sample;
  const Vec3 way(lamp.corner - point);
  sample.distance = glm::length(way);
  if (!(sample.distance > 0.0F) || sample.distance >= lamp.reach) return sample;
  sample.direction = way / sample.distance;
  sample.density = std::numeric_limits<float>::infinity();
  const float share = sample.distance / lamp.reach;
  float factor = (1.0F - share * share * share * share) / (sample.distance * sample.distance);
  if (lamp.cos_inner > -2.0F) {
    const float along = -glm::dot(lamp.normal, sample.direction);
    factor *= square(std::clamp((along - lamp.cos_outer) / (lamp.cos_inner - lamp.cos_outer), 0.0F, 1.0F));
  }
  sample.radiance = lamp.radiance * factor;
  return sample;
}

// Returns the radiance of the texel at a point of a textured lamp. `from_corner`: in the world.
Vec3 radiance_at(const PathLamp& lamp, Vec3 from_corner) {
  QUOIN_ASSERT(lamp.texels != nullptr, "a lamp with a texture");
  const auto in_voxel = [&](Vec3 along, float size) {
    const float voxels = std::clamp(glm::dot(from_corner, along), 0.0F, size) / lamp.voxel_size;
    return static_cast<double>(voxels - std::floor(voxels));
  };
  const FaceFrame& frame = frame_of(lamp.face);
  DVec3 inside(0.0);
  inside[frame.u] = in_voxel(lamp.u, lamp.size_u);
  inside[frame.v] = in_voxel(lamp.v, lamp.size_v);
  if (lamp.unturned != AxisOrientation()) inside = lamp.unturned.apply(inside - 0.5) + 0.5;
  return lamp.texels->colour(lamp.texels->texel(inside, IVec3(0), 0)) * lamp.light_of_texel;
}

LampSample sample_rectangle(const PathLamp& lamp, DVec3 point, Pair u) {
  QUOIN_ASSERT(!lamp.is_point, "a lamp with a body");
  LampSample sample;
  const Seen seen = seen_from(lamp, point);
  if (!seen.is_before) return sample;
  Vec3 way;
  if (seen.is_small) {
    way = seen.to_corner + lamp.u * (u.x * lamp.size_u) + lamp.v * (u.y * lamp.size_v);
  } else {
    const SphericalRectangle rectangle(lamp, seen.to_corner);
    const DVec3 local = rectangle.sample(u);
    way = lamp.u * static_cast<float>(local.x) + lamp.v * static_cast<float>(local.y) +
          lamp.normal * static_cast<float>(local.z);
    sample.density = density_of(rectangle);
  }
  sample.distance = glm::length(way);
  if (!(sample.distance > 0.0F)) return {};
  sample.direction = way / sample.distance;
  if (seen.is_small) sample.density = density_of(lamp, sample.direction, sample.distance);
  if (!(sample.density > 0.0F)) return sample;
  const Vec3 radiance = lamp.texels == nullptr ? lamp.radiance : radiance_at(lamp, way - seen.to_corner);
  sample.radiance = radiance / sample.density;
  return sample;
}

LampBounds bounds_of(const PathLamp& lamp, DVec3 origin) {
  LampBounds bounds;
  const Vec3 corner(lamp.corner - origin);
  bounds.low = bounds.high = corner;
  for (const Vec3 along : {lamp.u * lamp.size_u, lamp.v * lamp.size_v}) {
    bounds.low += glm::min(along, Vec3(0.0F));
    bounds.high += glm::max(along, Vec3(0.0F));
  }
  bounds.axis = lamp.normal;
  const float light = std::max(luminance(lamp.radiance), 1e-30F);
  if (lamp.is_point) {
    bounds.cos_spread = lamp.cos_inner > -2.0F ? std::max(lamp.cos_outer, -1.0F) : -1.0F;
    bounds.cos_edge = bounds.cos_spread > -1.0F ? 1.0F : -1.0F;
    // A spot has full brightness within its cone; the edge lies slightly beyond, so that rounding darkens no point.
    if (bounds.cos_edge > 0.0F) bounds.cos_edge = 0.999F;
    bounds.power = light;
  } else {
    bounds.power = light * lamp.size_u * lamp.size_v;
  }
  bounds.power = std::clamp(bounds.power, 1e-30F, 1e30F);
  return bounds;
}

}  // namespace

PathLamps::PathLamps(std::vector<PathLamp> lamps, DVec3 origin) : origin_(origin), lamps_(std::move(lamps)) {
  std::vector<LampBounds> bounds;
  bounds.reserve(lamps_.size());
  for (const PathLamp& lamp : lamps_) bounds.push_back(bounds_of(lamp, origin));
  tree_ = LightTree(bounds);
}

LampSample PathLamps::sample(LightTree::Choice chosen, DVec3 point, Pair u) const {
  if (chosen.lamp < 0 || !(chosen.probability > 0.0F)) return {};
  QUOIN_ASSERT(static_cast<std::size_t>(chosen.lamp) < lamps_.size(), "one of these lamps");
  const PathLamp& lamp = lamps_[static_cast<std::size_t>(chosen.lamp)];
  LampSample sample = lamp.is_point ? sample_point_lamp(lamp, point) : sample_rectangle(lamp, point, u);
  sample.radiance /= chosen.probability;
  sample.density *= chosen.probability;
  return sample;
}

float PathLamps::density(std::int32_t lamp, DVec3 point, Vec3 direction, float distance) const {
  QUOIN_ASSERT(lamp >= 0 && static_cast<std::size_t>(lamp) < lamps_.size(), "one of these lamps");
  const PathLamp& of = lamps_[static_cast<std::size_t>(lamp)];
  const Seen seen = seen_from(of, point);
  if (!seen.is_before) return 0.0F;
  return seen.is_small ? density_of(of, direction, distance) : density_of(SphericalRectangle(of, seen.to_corner));
}

std::size_t PathLamps::hash_of_face(std::int32_t placed, IVec3 voxel, Direction face) {
  std::uint32_t hash = static_cast<std::uint32_t>(placed) * 8U + static_cast<std::uint32_t>(face);
  for (const int coordinate : {voxel.x, voxel.y, voxel.z})
    hash = mix_bits(hash ^ static_cast<std::uint32_t>(coordinate));
  return hash;
}

void PathLamps::add_face(std::int32_t placed, IVec3 voxel, Direction face, std::int32_t lamp) {
  QUOIN_ASSERT(lamp >= 0 && static_cast<std::size_t>(lamp) < lamps_.size(), "a face of one of these lamps");
  if (2 * (face_count_ + 1) > faces_.size()) grow();
  QUOIN_ASSERT(std::has_single_bit(faces_.size()), "a power of two of slots");
  const std::size_t mask = faces_.size() - 1;
  std::size_t slot = hash_of_face(placed, voxel, face) & mask;
  while (faces_[slot].lamp >= 0) slot = (slot + 1) & mask;
  faces_[slot] = {voxel, placed, lamp, face};
  ++face_count_;
}

void PathLamps::grow() {
  std::vector<Face> old(std::bit_ceil(4 * face_count_ + 16));
  std::swap(old, faces_);
  face_count_ = 0;
  for (const Face& face : old) {
    if (face.lamp >= 0) add_face(face.placed, face.voxel, face.direction, face.lamp);
  }
}

std::int32_t PathLamps::lamp_of(std::int32_t placed, IVec3 voxel, Direction face) const {
  if (faces_.empty()) return -1;
  const std::size_t mask = faces_.size() - 1;
  for (std::size_t slot = hash_of_face(placed, voxel, face) & mask; faces_[slot].lamp >= 0; slot = (slot + 1) & mask) {
    const Face& found = faces_[slot];
    if (found.voxel == voxel && found.placed == placed && found.direction == face) return found.lamp;
  }
  return -1;
}

namespace {

QuadBuffer emissive_quads(const Grid& grid, const VoxelRegistry& types, IVec3 chunk, BlockyMesher& mesher) {
  const Chunk* found = grid.find_chunk(chunk);
  if (found == nullptr || !has_emissive_types(*found, types)) return {};
  QuadBuffer quads;
  mesher.mesh(grid.neighbourhood(chunk), types, {.merge = true, .bake_occlusion = false, .shapes = ShapeUse::Cubes},
              quads);
  std::erase_if(quads, [&](const Quad& quad) {
    return quad.type() >= types.size() || !types.is_opaque(quad.type()) || !(types[quad.type()].emission > 0.0F);
  });
  return quads;
}

PathLamp lamp_of_quad(const Quad& quad, IVec3 chunk, const PlacedGrid& placed, Vec3 radiance) {
  const FaceFrame& frame = frame_of(quad.direction());
  PathLamp lamp;
  const DVec3 corner(chunk * kChunkEdge + quad.corner(0));
  lamp.corner = placed.position + placed.world_axes * ((corner - placed.pivot) * placed.voxel_size);
  lamp.u = Vec3(placed.world_axes[frame.u]);
  lamp.v = Vec3(placed.world_axes[frame.v]);
  lamp.normal = Vec3(placed.world_axes[frame.axis] * static_cast<double>(frame.sign));
  lamp.size_u = static_cast<float>(quad.size_u() * placed.voxel_size);
  lamp.size_v = static_cast<float>(quad.size_v() * placed.voxel_size);
  lamp.radiance = radiance;
  lamp.face = quad.direction();
  lamp.voxel_size = static_cast<float>(placed.voxel_size);
  return lamp;
}

// Appends the chunks whose quads may have other orientations after changes of the voxels' data.
void add_turned(const Grid& grid, const VoxelRegistry& types, const DataChanges& data, std::vector<IVec3>& chunks) {
  if (!types.has_turned_by_state()) return;
  if (data.all) {
    chunks = grid.chunks();
    return;
  }
  for (const DataChange& change : data.items_unless_all()) chunks.push_back(change.chunk);
  sort_and_unite(chunks);
}

PathLamp lamp_without_body(const PlacedLamp& from) {
  PathLamp lamp;
  lamp.is_point = true;
  lamp.corner = from.position;
  lamp.u = {1.0F, 0.0F, 0.0F};
  lamp.v = {0.0F, 0.0F, 1.0F};
  if (from.cos_inner > -2.0) lamp.normal = Vec3(from.direction);
  // A white surface that faces it shows `power` at a distance of 1: it gets pi times that.
  lamp.radiance = from.power[0] * kPi;
  lamp.cos_inner = static_cast<float>(from.cos_inner);
  lamp.cos_outer = static_cast<float>(from.cos_outer);
  lamp.reach = static_cast<float>(std::min(from.reach, 1e30));
  return lamp;
}

}  // namespace

std::shared_ptr<const PathLamps> PathLampCache::lamps(const Scene& scene, std::span<const PlacedGrid> placed,
                                                      const Surfaces& surfaces, double brightness) {
  std::erase_if(quads_, [&](const auto& each) { return scene.grids().find(each.first) == nullptr; });
  std::vector<PathLamp> lamps;
  for (const PlacedLamp& lamp : placed_lamps(scene, brightness)) lamps.push_back(lamp_without_body(lamp));
  struct Face {
    std::int32_t placed;
    IVec3 first;
    Quad quad;
    std::int32_t lamp;
  };
  std::vector<Face> faces;
  BlockyMesher mesher;
  std::map<GridHandle, bool> is_known;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const GridHandle handle = scene.instances()[placed[i].instance].grid;
    OfGrid& of = quads_[handle];
    if (is_known.try_emplace(handle, true).second) {
      const Grid& grid = scene.grids().find(handle)->grid;
      ChangeCursor followed_data = of.followed_data;
      const DataChanges data = grid.data_changes_since(followed_data);
      const auto chunks_of = [&](const GridChanges& changes) {
        std::vector<IVec3> chunks = chunks_to_mesh(grid, changes);
        if (!changes.all) add_turned(grid, scene.types, data, chunks);
        return chunks;
      };
      of.quads.follow(grid, scene.types, chunks_of,
                      [&](IVec3 chunk) { return emissive_quads(grid, scene.types, chunk, mesher); });
      of.followed_data = followed_data;
    }
    of.quads.for_each([&](IVec3 chunk, const Quad& quad) {
      const auto factor = static_cast<float>(std::min(brightness, 1e9));
      const TypeFaces* const textured = surfaces.faces(quad.type());
      const AxisOrientation unturned = quad.orientation().inverse();
      const FaceTexels* const side =
          textured == nullptr ? nullptr : &textured->sides[static_cast<std::size_t>(unturned.apply(quad.direction()))];
      const Vec3 radiance = (side == nullptr ? surfaces[quad.type()].emitted : side->mean() * side->emission) * factor;
      if (is_black(radiance)) return;
      faces.push_back(
          {static_cast<std::int32_t>(i), chunk * kChunkEdge, quad, static_cast<std::int32_t>(lamps.size())});
      PathLamp& lamp = lamps.emplace_back(lamp_of_quad(quad, chunk, placed[i], radiance));
      if (side == nullptr) return;
      lamp.texels = side;
      lamp.unturned = unturned;
      lamp.light_of_texel = side->emission * factor;
    });
  }
  DBox bounds;
  for (const PathLamp& lamp : lamps) bounds.extend(lamp.corner);
  const DVec3 origin = bounds.empty() ? DVec3(0.0) : (bounds.min + bounds.max) * 0.5;
  auto made = std::make_shared<PathLamps>(std::move(lamps), origin);
  for (const Face& face : faces) {
    const FaceFrame& frame = frame_of(face.quad.direction());
    for (int v = 0; v < face.quad.size_v(); ++v) {
      for (int u = 0; u < face.quad.size_u(); ++u) {
        IVec3 voxel = face.first + face.quad.voxel();
        voxel[frame.u] += u;
        voxel[frame.v] += v;
        made->add_face(face.placed, voxel, face.quad.direction(), face.lamp);
      }
    }
  }
  return made;
}

}  // namespace quoin::path
