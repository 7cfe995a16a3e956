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
  if (lamp.is_of_shape) {
    sample.radiance *= far_light(lamp, sample.distance);
    sample.density = std::numeric_limits<float>::infinity();
  }
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
  const float light = std::max(luminance(lamp.radiance) * (1.0F + lamp.far_boost), 1e-30F);
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

// The mean light of the texels that a side shows, where hidden ones give none, and the share that is visible.
struct MeanLight {
  Vec3 light{1.0F};
  float visible = 1.0F;
};

MeanLight mean_light(const ModelFace& side, const VoxelFace& look) {
  const Vec3 tint = linear_colour(look.tint);
  if (look.texture.is_null()) return {tint, 1.0F};
  std::array<float, 2> low{1.0F, 1.0F};
  std::array<float, 2> high{0.0F, 0.0F};
  for (const std::array<float, 2>& corner : side.uv) {
    const std::array<float, 2> uv = texture_uv(side, look, corner);
    for (std::size_t i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], std::clamp(uv[i], 0.0F, 1.0F));
      high[i] = std::max(high[i], std::clamp(uv[i], 0.0F, 1.0F));
    }
  }
  // A level where the side shows at most 32 texels per axis.
  constexpr int kMostTexels = 32;
  const float widest = std::max({high[0] - low[0], high[1] - low[1], 1e-6F});
  int level = 0;
  while (level + 1 < look.texture.level_count() &&
         widest * static_cast<float>(look.texture.size() >> level) > kMostTexels) {
    ++level;
  }
  const int size = look.texture.size() >> level;
  const auto first = [&](std::size_t i) {
    return std::min(static_cast<int>(low[i] * static_cast<float>(size)), size - 1);
  };
  const auto end = [&](std::size_t i) {
    return std::clamp(static_cast<int>(std::ceil(high[i] * static_cast<float>(size))), first(i) + 1, size);
  };
  const std::span<const Rgba8> texels = look.texture.level(level);
  Vec3 sum(0.0F);
  float visible = 0.0F;
  for (int y = first(1); y < end(1); ++y) {
    for (int x = first(0); x < end(0); ++x) {
      const Rgba8 texel =
          texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x)];
      const float share = look.alpha == FaceAlpha::Opaque ? 1.0F : static_cast<float>(texel.a) / 255.0F;
      sum += linear_colour(texel) * share;
      visible += share;
    }
  }
  const auto count = static_cast<float>((end(0) - first(0)) * (end(1) - first(1)));
  return {sum * tint / count, visible / count};
}

// The light of each side of a model that is a lamp; 0 for other sides.
struct SideLights {
  std::vector<Vec3> lights;
  float far_boost = 0.0F;
};

// From afar, all together give the light of a voxel's six sides, as EmissiveCells do: a torch with a small flame lights
// a room. Sides that are no rectangles are found by chance, without a boost, and count too.
SideLights lights_of(const ShapeModel& model, const VoxelProperties& type) {
  constexpr float kSides = 6.0F;
  SideLights made{std::vector<Vec3>(model.faces.size(), Vec3(0.0F))};
  std::vector<Vec3>& lights = made.lights;
  float area = 0.0F;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const ModelFace& side = model.faces[i];
    const VoxelFace* const look = look_of(model, side, type.faces);
    if (!is_emitting_side(side, look, type)) continue;
    const MeanLight mean = look == nullptr ? MeanLight{linear_colour(type.colour)} : mean_light(side, *look);
    const auto& at = side.corners;
    area += 0.5F * glm::length(glm::cross(at[2] - at[0], at[3] - at[1])) * mean.visible;
    if (!is_lamp_side(side, look, type)) continue;
    lights[i] = mean.light * (emission_of(type) * (look == nullptr ? 1.0F : emission_factor(*look)));
  }
  if (area > 0.0F) made.far_boost = std::max(kSides / area - 1.0F, 0.0F);
  return made;
}

BlockVector<ShapeLamp> lamps_of_shapes(const Grid& grid, const VoxelRegistry& types, IVec3 chunk,
                                       BlockyMesher& mesher) {
  const Chunk* found = grid.find_chunk(chunk);
  const auto is_lamp = [&](VoxelType type) { return types.is_shaped(type) && types[type].emission > 0.0F; };
  if (found == nullptr || !types.has_shapes() || std::ranges::none_of(found->types(), is_lamp)) return {};
  QuadBuffer quads;
  ShapeFaceBuffer sides;
  mesher.mesh(grid.neighbourhood(chunk), types, {.bake_occlusion = false}, quads, sides);
  BlockVector<ShapeLamp> lamps;
  std::map<std::pair<const ShapeModel*, VoxelType>, SideLights> known;
  for (const ShapeFace& side : sides) {
    if (!is_lamp(side.type)) continue;
    const auto [lights, is_new] = known.try_emplace({side.model, side.type});
    if (is_new) lights->second = lights_of(*side.model, types[side.type]);
    const Vec3 light = lights->second.lights[side.face];
    if (is_black(light)) continue;
    const Vec3 corner = side.corner(0);
    lamps.push_back({corner, side.corner(1) - corner, side.corner(3) - corner, side.model_face().normal, light,
                     lights->second.far_boost});
  }
  return lamps;
}

PathLamp lamp_of_side(const ShapeLamp& side, IVec3 chunk, const PlacedGrid& placed, float factor) {
  PathLamp lamp;
  lamp.is_of_shape = true;
  const DVec3 corner = DVec3(chunk * kChunkEdge) + DVec3(side.corner);
  lamp.corner = placed.position + placed.world_axes * ((corner - placed.pivot) * placed.voxel_size);
  const auto turned = [&](const Vec3& along) { return glm::normalize(Vec3(placed.world_axes * DVec3(along))); };
  lamp.u = turned(side.u);
  lamp.v = turned(side.v);
  lamp.normal = turned(side.normal);
  lamp.size_u = static_cast<float>(glm::length(DVec3(side.u)) * placed.voxel_size);
  lamp.size_v = static_cast<float>(glm::length(DVec3(side.v)) * placed.voxel_size);
  lamp.radiance = side.radiance * factor;
  lamp.far_boost = side.far_boost;
  lamp.voxel_size = static_cast<float>(placed.voxel_size);
  return lamp;
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
      const auto near_shapes = [&](const GridChanges& changes) {
        std::vector<IVec3> chunks = chunks_to_mesh(grid, changes);
        if (!changes.all) add_near_shapes(grid, changes, data, chunks);
        return chunks;
      };
      of.quads.follow(grid, scene.types, chunks_of,
                      [&](IVec3 chunk) { return emissive_quads(grid, scene.types, chunk, mesher); });
      of.sides.follow(grid, scene.types, near_shapes,
                      [&](IVec3 chunk) { return lamps_of_shapes(grid, scene.types, chunk, mesher); });
      of.followed_data = followed_data;
    }
    const auto factor = static_cast<float>(std::min(brightness, 1e9));
    of.sides.for_each([&](IVec3 chunk, const ShapeLamp& side) {
      if (!is_black(side.radiance * factor)) lamps.push_back(lamp_of_side(side, chunk, placed[i], factor));
    });
    of.quads.for_each([&](IVec3 chunk, const Quad& quad) {
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
