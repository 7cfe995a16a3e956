// Rays through cutout and translucent texels, compared with a search over all faces of all voxels.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene_query.h>

#include "core/work/nightly_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/glass_bodies.h"
#include "scene/surfaces.h"

namespace quoin {
namespace {

using namespace render_test;

// Random colours. `alpha(random)` returns the alpha of a texel.
template <class Alpha>
Texture noise(int size, unsigned seed, const Alpha& alpha) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < size * size; ++i) {
    for (int c = 0; c < 3; ++c) image.rgba.push_back(static_cast<std::uint8_t>(random()));
    image.rgba.push_back(static_cast<std::uint8_t>(alpha(random)));
  }
  return Texture::from_image("noise", image).value();
}
Texture leaves(unsigned seed) {
  return noise(16, seed, [](std::mt19937& random) { return random() % 2 == 0 ? 255 : random() % 128; });
}
Texture panes(unsigned seed) {
  return noise(16, seed, [](std::mt19937& random) { return random() % 5 == 0 ? 255 : random() % 200; });
}
Texture solid(unsigned seed) {
  return noise(16, seed, [](std::mt19937&) { return 255; });
}
// One colour and alpha everywhere.
Texture plain(Rgba8 colour) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 256; ++i) image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, colour.a});
  return Texture::from_image("plain", image).value();
}
// A chess board with squares of `size` texels, which are of this colour or invisible.
Texture chess(Rgba8 colour, int size) {
  AlphaImage image{16, 16, {}};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool is_there = (x / size + y / size) % 2 == 0;
      image.rgba.insert(image.rgba.end(),
                        {colour.r, colour.g, colour.b, static_cast<std::uint8_t>(is_there ? 255 : 0)});
    }
  }
  return Texture::from_image("chess", image).value();
}

VoxelFace turned(VoxelFace face, std::mt19937& random) {
  face.turn = static_cast<std::uint8_t>(random() % 4);
  face.mirrored = random() % 2 == 0;
  if (random() % 2 == 0) face.tint = {255, 140, 60, 255};
  return face;
}
VoxelFace of_alpha(FaceAlpha alpha, unsigned seed, std::mt19937& random) {
  const Texture texture = alpha == FaceAlpha::Cutout        ? leaves(seed)
                          : alpha == FaceAlpha::Translucent ? panes(seed)
                                                            : solid(seed);
  return turned({.texture = texture, .alpha = alpha}, random);
}
VoxelType add_transparent(Scene& scene, const VoxelFaces& faces) {
  VoxelProperties properties;
  properties.visibility = Visibility::Transparent;
  properties.faces = faces;
  return scene.types.add(properties).value();
}

// The slow and obvious renderer: all faces of all voxels that the mesher would draw.
class AllFaces {
 public:
  explicit AllFaces(const Scene& scene) : types_(scene.types), grid_(scene.grids()[scene.grids().handles()[0]].grid) {
    const IBox box = grid_.bounds();
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) {
          if (grid_.get({x, y, z}) == kAir) continue;
          for (const Direction direction : kDirections) add({x, y, z}, direction);
        }
      }
    }
  }

  // Returns the unlit light of a ray that starts outside, before a background. `nearest`: the distance of the first
  // visible content.
  [[nodiscard]] Vec3 seen(const Ray& ray, Vec3 background, double& nearest) const {
    std::vector<Met> met;
    for (const Face& face : faces_) add_met(face, ray, met);
    // The ray leaves a voxel before it enters the next one.
    std::sort(met.begin(), met.end(),
              [](const Met& a, const Met& b) { return a.t != b.t ? a.t < b.t : a.is_outer < b.is_outer; });
    nearest = std::numeric_limits<double>::infinity();
    Vec3 light(0.0F);
    Vec3 passed(1.0F);
    for (std::size_t i = 0; i < met.size(); ++i) {
      const Met& at = met[i];
      float cover = 1.0F;
      Vec3 through(0.0F);
      Vec3 colour = at.colour;
      if (types_.is_transparent(at.face->type)) {
        const VoxelFaces& faces = types_[at.face->type].faces;
        const float alpha = faces.empty() ? static_cast<float>(types_[at.face->type].colour.a) / 255.0F : at.alpha;
        if (is_glass(at.face->type)) {
          if (!at.is_outer) continue;
          const double length = std::max(1.0, way_inside(met, i));
          cover = 1.0F - std::pow(1.0F - alpha, static_cast<float>(length));
          for (int c = 0; c < 3; ++c) {
            through[c] = std::pow((1.0F - alpha) * (1.0F - alpha * (1.0F - colour[c])), static_cast<float>(length));
          }
        } else {
          const FaceAlpha use = faces[at.face->direction].alpha;
          if (use == FaceAlpha::Translucent && !at.is_outer) continue;
          cover = use == FaceAlpha::Translucent ? alpha
                  : use == FaceAlpha::Cutout    ? (alpha >= 0.5F ? 1.0F : 0.0F)
                                                : 1.0F;
          through = (1.0F - cover) * (Vec3(1.0F) - cover * (Vec3(1.0F) - colour));
        }
      } else if (!at.is_outer) {
        continue;
      }
      if (cover == 0.0F && !is_glass(at.face->type)) continue;
      nearest = std::min(nearest, at.t);
      light += passed * cover * colour;
      passed *= through;
    }
    return light + passed * background;
  }

 private:
  struct Face {
    IVec3 voxel;
    Direction direction;
    VoxelType type;
  };
  struct Met {
    double t;
    const Face* face;
    bool is_outer;
    Vec3 colour;
    float alpha;
  };
  [[nodiscard]] bool is_glass(VoxelType type) const {
    if (!types_.is_transparent(type)) return false;
    const VoxelFaces& faces = types_[type].faces;
    return faces.empty() || std::ranges::all_of(kDirections, [&](Direction each) {
             return faces[each].alpha == FaceAlpha::Translucent;
           });
  }
  void add(IVec3 voxel, Direction direction) {
    const VoxelType type = grid_.get(voxel);
    const VoxelType other = grid_.get(voxel + normal_of(direction));
    if (types_.is_opaque(other) || (types_.is_transparent(type) && other == type)) return;
    faces_.push_back({voxel, direction, type});
  }
  void add_met(const Face& face, const Ray& ray, std::vector<Met>& out) const {
    const FaceFrame& frame = frame_of(face.direction);
    const double along = ray.direction[frame.axis];
    if (along == 0.0) return;
    const double plane = face.voxel[frame.axis] + (frame.sign > 0 ? 1 : 0);
    const double t = (plane - ray.origin[frame.axis]) / along;
    const DVec3 inside = ray.origin + ray.direction * t - DVec3(face.voxel);
    if (!(t > 0.0) || inside[frame.u] < 0.0 || inside[frame.u] >= 1.0 || inside[frame.v] < 0.0 ||
        inside[frame.v] >= 1.0) {
      return;
    }
    Met met{t, &face, along * frame.sign < 0.0, Vec3(0.0F), 0.0F};
    const VoxelProperties& type = types_[face.type];
    met.colour = linear(type.colour);
    if (!type.faces.empty()) {
      const auto texel = texel_at(type.faces[face.direction], face.direction, inside, 0);
      met.colour = {texel[0], texel[1], texel[2]};
      met.alpha = texel[3];
    }
    out.push_back(met);
  }
  // Returns the length of the ray in glass that it enters at `met[i]`.
  [[nodiscard]] double way_inside(const std::vector<Met>& met, std::size_t i) const {
    for (std::size_t next = i + 1; next < met.size(); ++next) {
      if (!met[next].is_outer && met[next].face->type == met[i].face->type) return met[next].t - met[i].t;
      // An opaque voxel that touches the glass.
      if (types_.is_opaque(met[next].face->type)) return met[next].t - met[i].t;
    }
    ADD_FAILURE() << "glass without an end";
    return 0.0;
  }

  const VoxelRegistry& types_;
  const Grid& grid_;
  std::vector<Face> faces_;
};

Scene random_scene(unsigned seed) {
  std::mt19937 random(seed);
  Scene scene;
  std::vector<VoxelType> all{add_type(scene, {90, 120, 30, 255}),
                             add_type(scene, {200, 80, 70, 90}, Visibility::Transparent)};
  VoxelProperties brick;
  brick.faces = solid(seed);
  all.push_back(scene.types.add(brick).value());
  const auto same = [&](FaceAlpha alpha, unsigned number) {
    return VoxelFaces(of_alpha(alpha, seed + number, random));
  };
  all.push_back(add_transparent(scene, same(FaceAlpha::Cutout, 1)));
  all.push_back(add_transparent(scene, same(FaceAlpha::Cutout, 2)));
  all.push_back(add_transparent(scene, same(FaceAlpha::Translucent, 3)));
  all.push_back(add_transparent(scene, same(FaceAlpha::Opaque, 4)));
  std::array<VoxelFace, 6> mixed;
  for (VoxelFace& face : mixed) face = of_alpha(static_cast<FaceAlpha>(random() % 3), seed + 5, random);
  mixed[0] = of_alpha(FaceAlpha::Cutout, seed + 6, random);
  all.push_back(add_transparent(scene, VoxelFaces(mixed)));
  Grid grid;
  for (int i = 0; i < 5 * 5 * 5; ++i) {
    if (random() % 2 == 0) grid.set({i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2}, all[random() % all.size()]);
  }
  // A whole cell of one type.
  if (seed % 2 == 0) grid.fill_box({{4, 0, 0}, {8, 4, 4}}, all[2 + random() % (all.size() - 2)]);
  place(scene, std::move(grid));
  return scene;
}

TEST(RenderCutout, AgreesWithSearchOverAllFaces) {
  constexpr int kPixels = 256;
  for (unsigned seed = 1; seed <= static_cast<unsigned>(cases(4, 40)); ++seed) {
    SCOPED_TRACE(seed);
    const Scene scene = random_scene(seed);
    const AllFaces all(scene);
    std::mt19937 random(seed);
    const auto number = [&] { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); };
    Camera camera = towards(glm::normalize(DVec3(number(), number(), number())) * 20.0, {1, 0.5, 0.5});
    camera.projection = Camera::Projection::Orthographic;
    camera.view_height = 9.0;
    RenderOptions options = sized(kPixels, kPixels);
    options.light.shading = Shading::Unlit;
    const CpuRenderer renderer(scene);
    const RenderedImage image = renderer.render(camera, options).value();
    // The background of each pixel, from an empty scene.
    const Scene empty;
    const RenderedImage sky = taken(empty, camera, options);
    int wrong = 0;
    int wrong_depth = 0;
    for (int y = 0; y < kPixels; ++y) {
      for (int x = 0; x < kPixels; ++x) {
        const Ray ray{camera.position + camera.right * (((x + 0.5) / kPixels - 0.5) * 9.0) -
                          camera.up * (((y + 0.5) / kPixels - 0.5) * 9.0),
                      camera.forward};
        const Pixel behind = pixel_at(sky, x, y);
        double nearest = 0.0;
        const Vec3 background{linear_from_srgb(behind[0]), linear_from_srgb(behind[1]), linear_from_srgb(behind[2])};
        const Pixel expected = encoded(all.seen(ray, background, nearest));
        const Pixel found = pixel_at(image, x, y);
        bool is_wrong = false;
        for (std::size_t c = 0; c < 3; ++c) is_wrong |= std::abs(expected[c] - found[c]) > 1;
        wrong += is_wrong;
        const auto depth = static_cast<double>(depth_at(image, x, y));
        wrong_depth += depth != nearest && !(std::abs(depth - nearest) < 1e-4);
      }
    }
    EXPECT_LE(wrong, kPixels * kPixels / 2000);
    EXPECT_LE(wrong_depth, kPixels * kPixels / 2000);
  }
}

// Two grids with a gap between them look as one: content of the nearer grid hides that of the other.
TEST(RenderCutout, ShowsTwoGridsAsOne) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Scene one = random_scene(seed);
    Scene two;
    two.types = one.types;
    Grid& whole = one.edit(one.grids().handles()[0]).grid;
    whole.fill_box({{-3, -3, 0}, {9, 9, 1}}, kAir);
    std::array<Grid, 2> parts;
    const IBox box = whole.bounds();
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) parts[z > 0 ? 1 : 0].set({x, y, z}, whole.get({x, y, z}));
      }
    }
    for (Grid& part : parts) place(two, std::move(part));
    RenderOptions options = sized(120, 90);
    options.light = natural_light();
    for (const DVec3 eye : {DVec3(7, 5, 14), DVec3(-6, 9, -13)}) {
      const RenderedImage a = taken(one, towards(eye, {1, 0, 0}), options);
      const RenderedImage b = taken(two, towards(eye, {1, 0, 0}), options);
      EXPECT_LE(count_different(a, b, 1), 20) << seed;
    }
  }
}

// In one grid and in two.
TEST(RenderCutout, PacketsEndAtTheSameTexelsAsSingleRays) {
  int ended_count = 0;
  int passed_count = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Scene scene = random_scene(seed);
    if (seed % 2 == 0) {
      Grid other;
      other.fill_box({{-3, -3, 3}, {3, 3, 5}}, 4);  // cutout
      place(scene, std::move(other));
    }
    const SceneTracer tracer(scene);
    const Surfaces surfaces(scene.types);
    const SceneView view(tracer, DVec3(0.0));
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int round = 0; round < cases(60, 2000); ++round) {
      RayPacket rays;
      const DVec3 near{between(-6.0, 8.0), between(-4.0, 5.0), between(-6.0, 6.0)};
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const DVec3 off{between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)};
        const DVec3 direction{between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)};
        rays.set(lane, {near + off, glm::normalize(direction)}, 6.0);
      }
      rays.active &= ~view.any_hits(0, rays);
      std::uint32_t met = 0;
      const std::uint32_t ended = ends_at_faces(view, surfaces, 0, rays, met);
      EXPECT_EQ(ended & ~met, 0U);
      for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        SeenThrough seen;
        find_transparent(view, surfaces, rays.ray(lane), 6.0, seen);
        ASSERT_EQ(seen.is_closed(), (ended >> lane & 1U) != 0) << seed;
        ASSERT_TRUE(seen.faces.empty() || (met >> lane & 1U) != 0);
        (seen.is_closed() ? ended_count : passed_count) += 1;
      }
    }
  }
  EXPECT_GT(ended_count, 100);
  EXPECT_GT(passed_count, 100);
}

// The sun shines straight down on a plate below one of cutout or translucent texels.
TEST(RenderCutout, CastsShadowsOfTexels) {
  constexpr int kPixels = 64;
  for (const FaceAlpha alpha : {FaceAlpha::Cutout, FaceAlpha::Translucent}) {
    Scene scene;
    const VoxelType white = add_type(scene, {255, 255, 255, 255});
    const Texture texture = alpha == FaceAlpha::Cutout ? chess({30, 200, 30, 255}, 4) : plain({200, 60, 20, 128});
    const VoxelType above = add_transparent(scene, VoxelFace{.texture = texture, .alpha = alpha});
    Grid grid;
    grid.fill_box({{-4, -1, -4}, {4, 0, 4}}, white);
    grid.fill_box({{-4, 3, -4}, {4, 4, 4}}, above);
    place(scene, std::move(grid));
    RenderOptions options = sized(kPixels, kPixels);
    environment_in(options).sun.direction = {0, 1, 0};
    options.light.occlusion_mode = OcclusionMode::Off;
    const RenderedImage image = taken(scene, from_above(0.0, 2.0, 0.0, 4.0), options);
    const VoxelFace& face = scene.types[above].faces[Direction::PosY];
    for (int y = 0; y < kPixels; ++y) {
      for (int x = 0; x < kPixels; ++x) {
        const DVec3 at{(x + 0.5) / 16 - 2.0, 0.0, (y + 0.5) / 16 - 2.0};
        const auto texel = texel_at(face, Direction::PosY, at - glm::floor(at), 0);
        const Vec3 colour(texel[0], texel[1], texel[2]);
        Vec3 sun(texel[3] < 0.5F ? 1.0F : 0.0F);
        if (alpha == FaceAlpha::Translucent) sun = (1.0F - texel[3]) * (1.0F - texel[3] * (1.0F - colour));
        const Pixel expected = encoded(glm::min(0.1F + sun, 1.0F));
        const Pixel found = pixel_at(image, x, y);
        for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(found[c], expected[c], 1) << x << ' ' << y;
      }
    }
  }
}

TEST(RenderCutout, ShowsInnerSidesOfThickBlocks) {
  Scene scene;
  const VoxelType leaf =
      add_transparent(scene, VoxelFace{.texture = chess({30, 200, 30, 255}, 4), .alpha = FaceAlpha::Cutout});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {2, 2, 2}}, leaf);
  place(scene, std::move(grid));
  Camera camera = from_above(1.0, 12.0, 1.0, 2.0);
  RenderOptions options = sized(32, 32);
  options.light.shading = Shading::Unlit;
  const RenderedImage image = taken(scene, camera, options);
  const Pixel green = encoded(linear({30, 200, 30, 255}));
  int above = 0;
  int behind = 0;
  int sky = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      const float depth = depth_at(image, x, y);
      // Straight down, the holes of the top and of the bottom lie over each other.
      if (std::abs(depth - 10.0F) < 1e-4F) {
        ++above;
        EXPECT_EQ(pixel_at(image, x, y), green);
      } else if (std::isinf(depth)) {
        ++sky;
      } else {
        ++behind;
      }
    }
  }
  EXPECT_EQ(above, 512);
  EXPECT_EQ(sky, 512);
  EXPECT_EQ(behind, 0) << "no faces between voxels of one type";
  // Seen askew, the bottom's inner side appears in the holes.
  camera = towards({1.4, 12.0, 1.3}, {1.0, 0.0, 1.0}, 0.14);
  const RenderedImage askew = taken(scene, camera, options);
  int inner = 0;
  for (const float depth : askew.depth.values) inner += depth > 11.5F && depth < 14.0F;
  EXPECT_GT(inner, 50);
}

TEST(RenderCutout, BlendsPanesInARow) {
  for (const bool is_hollow : {false, true}) {
    Scene scene;
    const Rgba8 tint{200, 120, 40, 96};
    std::array<VoxelFace, 6> faces;
    for (VoxelFace& face : faces) face = {.texture = plain(tint), .alpha = FaceAlpha::Translucent};
    // One cutout face makes the type a cell of faces; its other faces look the same.
    if (is_hollow) faces[0] = {.texture = chess(tint, 4), .alpha = FaceAlpha::Cutout};
    const VoxelType pane = add_transparent(scene, VoxelFaces(faces));
    const VoxelType wall = add_type(scene, {40, 90, 220, 255});
    Grid grid;
    for (const int z : {0, 2, 5}) grid.fill_box({{-3, -3, z}, {3, 3, z + 1}}, pane);
    grid.fill_box({{-3, -3, -4}, {3, 3, -3}}, wall);
    place(scene, std::move(grid));
    Camera camera = towards({0.3, 0.2, 10.0}, {0.3, 0.2, 0.0});
    camera.projection = Camera::Projection::Orthographic;
    camera.view_height = 0.1;
    RenderOptions options = sized(5, 5);
    options.light.shading = Shading::Unlit;
    const RenderedImage image = taken(scene, camera, options);
    const Vec3 colour = linear(tint);
    const float alpha = 96.0F / 255.0F;
    Vec3 expected = linear({40, 90, 220, 255});
    for (int i = 0; i < 3; ++i) {
      expected = alpha * colour + (1.0F - alpha) * (1.0F - alpha * (1.0F - colour)) * expected;
    }
    const Pixel found = pixel_at(image, 2, 2);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], encoded(expected)[c], 1) << is_hollow;
    EXPECT_NEAR(depth_at(image, 2, 2), 4.0F, 1e-5F);
  }
}

// Cutout types without invisible texels look as opaque ones, and those without visible texels as air: in light, shadow,
// occlusion and the light of lamps.
TEST(RenderCutout, LightsVisibleTexelsAsOpaqueOnesAndInvisibleOnesAsAir) {
  const auto scene_with = [](Visibility visibility, FaceAlpha alpha, std::uint8_t opacity, bool has_wall) {
    Scene scene;
    const VoxelType ground = add_type(scene, {180, 180, 170, 255});
    const VoxelType glow = add_type(scene, {255, 200, 120, 255}, Visibility::Opaque, 4.0F);
    VoxelProperties wall;
    wall.visibility = visibility;
    wall.faces = VoxelFace{.texture = noise(16, 3, [&](std::mt19937&) { return opacity; }), .alpha = alpha};
    const VoxelType type = scene.types.add(wall).value();
    Grid grid;
    grid.fill_box({{-8, -1, -8}, {8, 0, 8}}, ground);
    if (has_wall) {
      grid.fill_box({{-3, 0, -2}, {4, 4, -1}}, type);
      grid.fill_box({{2, 0, 1}, {5, 2, 4}}, type);
      grid.set({-4, 2, 3}, type);
    }
    grid.set({-6, 0, 5}, glow);
    const InstanceHandle handle = place(scene, std::move(grid), {3, 2, 1});
    Instance& moved = scene.edit(handle);
    moved.mirrored = true;
    moved.voxel_size = 0.5;
    moved.rotation = glm::angleAxis(0.4, glm::normalize(DVec3(0.2, 1, 0.1)));
    Lamp lamp;
    lamp.position = {4.5, 4.0, 3.0};
    lamp.intensity = 3.0;
    scene.lamps.push_back(lamp);
    return scene;
  };
  RenderOptions options = sized(120, 90);
  options.light.max_lamps = 16;
  for (const LightModel model : {LightModel::Rays, LightModel::Propagated}) {
    for (const OcclusionAffects affects : {OcclusionAffects::Ambient, OcclusionAffects::All}) {
      options.light.model = model;
      options.light.occlusion_affects = affects;
      const auto image = [&](const Scene& scene) { return taken(scene, towards({9, 7, 8}, {3, 2, 1}), options); };
      const RenderedImage visible = image(scene_with(Visibility::Transparent, FaceAlpha::Cutout, 255, true));
      const RenderedImage opaque = image(scene_with(Visibility::Opaque, FaceAlpha::Opaque, 255, true));
      // Propagated light passes a transparent type.
      if (model == LightModel::Rays) {
        EXPECT_LE(count_different(visible, opaque, 1), 20);
      }
      const RenderedImage invisible = image(scene_with(Visibility::Transparent, FaceAlpha::Cutout, 0, true));
      const RenderedImage air = image(scene_with(Visibility::Transparent, FaceAlpha::Cutout, 0, false));
      EXPECT_EQ(count_different(invisible, air, 0), 0);
      EXPECT_GT(count_different(visible, air, 8), 1000);
      EXPECT_EQ(invisible.depth.values, air.depth.values);
      for (std::size_t i = 0; model == LightModel::Rays && i < visible.depth.values.size(); ++i) {
        const float a = visible.depth.values[i];
        const float b = opaque.depth.values[i];
        EXPECT_TRUE(a == b || std::abs(a - b) < 1e-3F) << i;
      }
    }
  }
}

// A ray query is about matter: it hits a voxel also where its texels are invisible.
TEST(RenderCutout, HitsVoxelsInQueriesRegardlessOfTexels) {
  Scene scene;
  const VoxelType leaf = add_transparent(scene, VoxelFace{.texture = plain({9, 9, 9, 0}), .alpha = FaceAlpha::Cutout});
  Grid grid;
  grid.set({0, 0, 0}, leaf);
  place(scene, std::move(grid));
  const auto hit = first_hit(SceneTracer(scene), {{0.3, 0.4, 5.0}, {0, 0, -1}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->type, leaf);
  EXPECT_DOUBLE_EQ(hit->t, 4.0);
}

TEST(RenderCutout, FollowsChangesOfTypes) {
  Scene scene = random_scene(4);
  const Camera camera = towards({9, 7, 12}, {1, 0, 0});
  CpuRenderer renderer(scene);
  const auto replace = [&](VoxelType type, const VoxelFaces& faces, Visibility visibility) {
    VoxelProperties properties = scene.types[type];
    properties.faces = faces;
    properties.visibility = visibility;
    scene.types.replace(type, properties);
    renderer.update();
    const RenderedImage updated = renderer.render(camera, sized(80, 60)).value();
    EXPECT_EQ(updated.colour.rgb, taken(scene, camera, sized(80, 60)).colour.rgb);
    return updated;
  };
  const auto first = replace(4, VoxelFaces(), Visibility::Transparent);
  const auto second =
      replace(4, VoxelFace{.texture = panes(7), .alpha = FaceAlpha::Translucent}, Visibility::Transparent);
  const auto third = replace(4, VoxelFace{.texture = leaves(7), .alpha = FaceAlpha::Cutout}, Visibility::Transparent);
  const auto fourth = replace(4, solid(7), Visibility::Opaque);
  EXPECT_GT(count_different(first, second, 4), 30);
  EXPECT_GT(count_different(second, third, 4), 30);
  EXPECT_GT(count_different(third, fourth, 4), 30);
}

// Cells of a halved grid stand for many voxels: they are glass of the mean colour.
TEST(RenderCutout, DrawsHalvedGridsAsGlass) {
  Scene scene;
  const VoxelType leaf = add_transparent(scene, VoxelFace{.texture = leaves(3), .alpha = FaceAlpha::Cutout});
  Grid grid;
  grid.fill_box({{-32, 0, -32}, {32, 32, 32}}, leaf);
  place(scene, std::move(grid));
  RenderOptions options = sized(9, 9);
  options.light.shading = Shading::Unlit;
  options.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 1e6, .far_pixels = 0};
  const Pixel mean = encoded(scene.types[leaf].faces[Direction::PosY].texture.mean() *
                             linear(scene.types[leaf].faces[Direction::PosY].tint));
  const Pixel found = pixel_at(taken(scene, from_above(0.3, 60, 0.4, 1.0), options), 4, 4);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], mean[c], 2);
}

}  // namespace
}  // namespace quoin
