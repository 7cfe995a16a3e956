#include <quoin/grid/texture.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>
#include <random>
#include <string>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>

#include "core/srgb.h"

namespace quoin {
namespace {

AlphaImage noise(int size, unsigned seed, bool with_alpha) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < 4 * size * size; ++i) {
    const bool is_alpha = i % 4 == 3;
    image.rgba.push_back(is_alpha && !with_alpha ? 255 : static_cast<std::uint8_t>(random()));
  }
  return image;
}

AlphaImage plain(int size, Rgba8 colour) {
  AlphaImage image{size, size, {}};
  for (int i = 0; i < size * size; ++i) {
    image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, colour.a});
  }
  return image;
}

Texture texture_of(const AlphaImage& image, const char* name = "t") {
  return Texture::from_image(name, image).value();
}

std::string error_of_image(const AlphaImage& image) {
  const auto made = Texture::from_image("wall", image);
  return made ? "" : made.error().message;
}

TEST(DeferredTexture, MakesTexelsWhenTheyAreFirstRead) {
  const AlphaImage image = noise(64, 5, true);
  const Texture eager = texture_of(image);
  std::atomic<int> decoded = 0;
  const Texture texture = Texture::deferred("t", image, [&] {
                            ++decoded;
                            return image;
                          }).value();
  EXPECT_EQ(texture.mean(), eager.mean());
  EXPECT_EQ(texture.mean_alpha(), eager.mean_alpha());
  EXPECT_EQ(texture.coverage(), eager.coverage());
  EXPECT_EQ(texture.is_opaque(), eager.is_opaque());
  EXPECT_EQ(texture.hash(), eager.hash());
  EXPECT_EQ(texture.size(), 64);
  EXPECT_EQ(texture.level_count(), 7);
  EXPECT_EQ(texture.bytes(), eager.bytes());
  // A registry needs no texels.
  VoxelRegistry types;
  const VoxelProperties type{.name = "t",
                             .visibility = Visibility::Transparent,
                             .faces = VoxelFaces(VoxelFace{.texture = texture, .alpha = FaceAlpha::Cutout})};
  ASSERT_TRUE(types.add(type));
  EXPECT_EQ(types.find_or_add(type), VoxelType{1});
  EXPECT_EQ(types[1].colour, type.faces.mean_colour());
  EXPECT_FALSE(texture.has_texels());
  EXPECT_TRUE(eager.has_texels());
  EXPECT_EQ(decoded, 0);
  EXPECT_EQ(texture.image().rgba, image.rgba);
  EXPECT_EQ(decoded, 1);
  EXPECT_FALSE(texture.has_texels()) << "files do not keep texels";
  decoded = 0;
  parallel_for(64, {8}, [&](std::size_t i) {
    const int level = static_cast<int>(i) % 7;
    EXPECT_TRUE(std::ranges::equal(texture.level(level), eager.level(level)));
  });
  EXPECT_EQ(decoded, 1) << "by one of the threads";
  EXPECT_EQ(texture.image().rgba, image.rgba);
  EXPECT_EQ(decoded, 1) << "from its texels";
  EXPECT_TRUE(texture.has_texels());
  EXPECT_EQ(texture, eager);
}

TEST(DeferredTexture, ComparisonsKeepNoTexels) {
  const auto deferred = [](const AlphaImage& image) {
    return Texture::deferred("t", image, [image] { return image; }).value();
  };
  const AlphaImage image = noise(16, 5, true);
  const Texture one = deferred(image);
  const Texture same = deferred(image);
  EXPECT_EQ(one, same);
  EXPECT_EQ(one, texture_of(image));
  EXPECT_EQ(texture_of(image), one);
  EXPECT_FALSE(one == deferred(noise(16, 6, true)));
  EXPECT_FALSE(one == texture_of(noise(32, 5, true)));
  EXPECT_FALSE(one.has_texels() || same.has_texels());
}

TEST(DeferredTexture, AreDecodedForAllTypesAtOnce) {
  VoxelRegistry types;
  std::atomic<int> decoded = 0;
  const auto deferred = [&](unsigned seed) {
    const AlphaImage image = noise(16, seed, false);
    return Texture::deferred("t" + std::to_string(seed), image,
                             [&decoded, image] {
                               ++decoded;
                               return image;
                             })
        .value();
  };
  const Texture face = deferred(1);
  ASSERT_TRUE(types.add({.name = "cube", .faces = VoxelFaces(face)}));
  ShapeElement box{.max = Vec3(16, 8, 16)};
  const Texture top = deferred(2);
  box.faces[2].face = VoxelFace{top};
  ASSERT_TRUE(types.add({.name = "slab", .shapes = *VoxelShape::from_elements({box})}));
  EXPECT_EQ(&decode_textures(types, {2}), &types);
  EXPECT_TRUE(face.has_texels() && top.has_texels());
  EXPECT_EQ(decoded, 2);
  decode_textures(types, {2});
  EXPECT_EQ(decoded, 2);
}

TEST(DeferredTexture, RefusesWrongSizesAndTriesAgainWithoutMemory) {
  EXPECT_FALSE(Texture::deferred("t", plain(8, {}), [] { return plain(8, {}); }));
  const AlphaImage image = noise(16, 1, false);
  bool has_memory = false;
  const Texture texture = Texture::deferred("t", image, [&] {
                            if (!has_memory) throw std::bad_alloc();
                            return image;
                          }).value();
  EXPECT_THROW(static_cast<void>(texture.level(0)), std::bad_alloc);
  EXPECT_FALSE(texture.has_texels());
  has_memory = true;
  EXPECT_TRUE(std::ranges::equal(texture.level(0), texture_of(image).level(0)));
}

TEST(Texture, RefusesWrongSizesByName) {
  const std::string sides =
      "cannot use texture \"wall\": its sides must be equal, and 16, 32, 64, 128, 256, 512 or 1024 texels long, not ";
  EXPECT_EQ(error_of_image({0, 0, {}}), sides + "0 x 0 texels");
  EXPECT_EQ(error_of_image({16, 32, std::vector<std::uint8_t>(4 * 16 * 32)}), sides + "16 x 32 texels");
  EXPECT_EQ(error_of_image({-16, -16, std::vector<std::uint8_t>(1024)}), sides + "-16 x -16 texels");
  EXPECT_EQ(error_of_image(plain(8, {})), sides + "8 x 8 texels");
  EXPECT_EQ(error_of_image(plain(48, {})), sides + "48 x 48 texels");
  EXPECT_EQ(error_of_image({2048, 2048, {}}), sides + "2048 x 2048 texels");
  EXPECT_EQ(error_of_image({16, 16, std::vector<std::uint8_t>(1023)}),
            "cannot use texture \"wall\": it must have 4 bytes for each of its 16 x 16 texels");
  for (int size = kMinTextureSize; size <= kMaxTextureSize; size *= 2)
    EXPECT_EQ(error_of_image(plain(size, {})), "") << size;
}

TEST(Texture, KeepsTexelsAndHalvesToOne) {
  const AlphaImage image = noise(64, 3, true);
  const Texture texture = texture_of(image);
  EXPECT_EQ(texture.size(), 64);
  ASSERT_EQ(texture.level_count(), 7);
  std::size_t texels = 0;
  for (int level = 0; level < 7; ++level) {
    EXPECT_EQ(texture.level(level).size(), std::size_t{64U >> level} * (64U >> level));
    texels += texture.level(level).size();
  }
  EXPECT_EQ(texture.bytes(), 4 * texels);
  for (std::size_t i = 0; i < texture.level(0).size(); ++i) {
    const Rgba8 texel = texture.level(0)[i];
    ASSERT_TRUE(texel.r == image.rgba[4 * i] && texel.g == image.rgba[4 * i + 1] && texel.b == image.rgba[4 * i + 2] &&
                texel.a == image.rgba[4 * i + 3]);
  }
}

TEST(Texture, AveragesLinearLightWeightedByAlpha) {
  const AlphaImage image = noise(32, 4, true);
  const Texture texture = texture_of(image);
  for (int level = 1; level < texture.level_count(); ++level) {
    const int size = 32 >> level;
    const int block = 1 << level;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        DVec3 sum(0.0);
        double alpha = 0.0;
        for (int i = 0; i < block * block; ++i) {
          const Rgba8 texel =
              texture.level(0)[static_cast<std::size_t>((y * block + i / block) * 32 + x * block + i % block)];
          sum += DVec3(linear_colour(texel)) * (texel.a / 255.0);
          alpha += texel.a / 255.0;
        }
        const Rgba8 mean = texture.level(level)[static_cast<std::size_t>(y * size + x)];
        const DVec3 expected = sum / alpha;
        for (int c = 0; c < 3; ++c) {
          const std::uint8_t byte = c == 0 ? mean.r : c == 1 ? mean.g : mean.b;
          EXPECT_NEAR(byte, SrgbEncoder::shared()(static_cast<float>(expected[c])), 1);
        }
        EXPECT_NEAR(mean.a, alpha / (block * block) * 255.0, 0.51);
      }
    }
  }
  const Rgba8 last = texture.level(texture.level_count() - 1)[0];
  EXPECT_EQ(srgb_colour(texture.mean()), (Rgba8{last.r, last.g, last.b, 255}));
}

TEST(Texture, HidesColoursOfInvisibleTexels) {
  AlphaImage image = plain(16, {255, 0, 0, 0});
  for (std::size_t i = 0; i < 16 * 16; i += 2) {
    image.rgba[4 * i] = 0;
    image.rgba[4 * i + 1] = 200;
    image.rgba[4 * i + 3] = 255;
  }
  const Texture leaves = texture_of(image);
  EXPECT_EQ(leaves.level(1)[0], (Rgba8{0, 200, 0, 128}));
  EXPECT_FALSE(leaves.is_opaque());
  EXPECT_FLOAT_EQ(leaves.coverage(), 0.5F);
  EXPECT_FLOAT_EQ(leaves.mean_alpha(), 0.5F);
  EXPECT_EQ(srgb_colour(leaves.mean()), (Rgba8{0, 200, 0, 255}));
  const Texture invisible = texture_of(plain(16, {9, 8, 7, 0}));
  EXPECT_EQ(srgb_colour(invisible.mean()), (Rgba8{9, 8, 7, 255}));
  EXPECT_EQ(invisible.coverage(), 0.0F);
  EXPECT_EQ(texture_of(plain(16, {9, 8, 7, 127})).coverage(), 0.0F);
  EXPECT_EQ(texture_of(plain(16, {9, 8, 7, 128})).coverage(), 1.0F);
}

TEST(Texture, ComparesNameAndTexels) {
  const Texture a = texture_of(noise(16, 1, false));
  EXPECT_EQ(a, texture_of(noise(16, 1, false)));
  EXPECT_EQ(a.hash(), texture_of(noise(16, 1, false)).hash());
  EXPECT_FALSE(a == texture_of(noise(16, 2, false)));
  EXPECT_FALSE(a == texture_of(noise(16, 1, false), "u"));
  EXPECT_FALSE(a == Texture());
  EXPECT_EQ(Texture(), Texture());
  const Texture copy = a;
  EXPECT_EQ(copy.level(0).data(), a.level(0).data()) << "copies share their texels";
}

TEST(TextureSet, SplitsArraysBySizeAndLimit) {
  TextureSet set(2);
  std::vector<Texture> textures;
  for (unsigned i = 0; i < 5; ++i) textures.push_back(texture_of(noise(16, i, false)));
  textures.push_back(texture_of(noise(32, 9, false)));
  std::size_t bytes = 0;
  for (const Texture& texture : textures) {
    set.add(texture);
    bytes += texture.bytes();
  }
  EXPECT_EQ(set.add(texture_of(noise(16, 3, false))), (TextureLayer{1, 1})) << "an equal texture";
  ASSERT_EQ(set.arrays().size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(set.arrays()[i].size, i == 3 ? 32 : 16);
    EXPECT_EQ(set.arrays()[i].layers.size(), i < 2 ? 2U : 1U);
  }
  EXPECT_EQ(set.bytes(), bytes);
  for (const Texture& texture : textures) EXPECT_EQ(set[set.find(texture).value()], texture);
  EXPECT_EQ(set.find(texture_of(noise(16, 77, false))), std::nullopt);
}

TEST(TextureSet, NeedsLittleMemoryForManyTextures) {
  VoxelRegistry types;
  for (unsigned i = 0; i < 1'024; ++i) {
    const Texture texture = texture_of(plain(64, {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8), 0}));
    ASSERT_TRUE(types.add({.name = std::to_string(i), .faces = texture}));
  }
  TextureSet set;
  set.add(types);
  ASSERT_EQ(set.arrays().size(), 1U);
  EXPECT_EQ(set.arrays()[0].layers.size(), 1'024U);
  EXPECT_LT(set.bytes(), 25'000'000U);
  EXPECT_EQ(set.arrays()[0].layers[7].level(0).data(), types[8].faces[Direction::PosX].texture.level(0).data())
      << "no copy";
}

// The texel of face coordinates `x` rightwards and `y` downwards, seen from outside, after a turn and a mirror, by
// moving the image itself.
std::size_t texel_by_moving(int size, const VoxelFace& face, int x, int y) {
  for (int i = 0; i < face.turn; ++i) {
    const int before = x;
    x = y;
    y = size - 1 - before;
  }
  if (face.mirrored) x = size - 1 - x;
  return static_cast<std::size_t>(y * size + x);
}

TEST(TextureFrame, TurnsClockwiseAfterTheMirror) {
  constexpr int kSize = 16;
  const Texture texture = texture_of(noise(kSize, 6, true));
  for (const Direction direction : kDirections) {
    const TextureFrame upright = texture_frame({texture}, direction);
    const IVec3 towards = normal_of(direction);
    EXPECT_EQ(glm::cross(DVec3(upright.right), -DVec3(upright.down)), DVec3(towards)) << "not mirrored";
    if (frame_of(direction).axis != 1) {
      EXPECT_EQ(upright.down, IVec3(0, -1, 0)) << name_of(direction);
    }
    for (std::uint8_t turn = 0; turn < 4; ++turn) {
      for (const bool mirrored : {false, true}) {
        const VoxelFace face{.texture = texture, .turn = turn, .mirrored = mirrored, .alpha = FaceAlpha::Translucent};
        for (int y = 0; y < kSize; ++y) {
          for (int x = 0; x < kSize; ++x) {
            // From the middle of the face, along the axes that a viewer sees.
            const DVec3 inside = DVec3(0.5) + DVec3(towards) * 0.5 + DVec3(upright.right) * ((x + 0.5) / kSize - 0.5) +
                                 DVec3(upright.down) * ((y + 0.5) / kSize - 0.5);
            const Rgba8 texel = texture.level(0)[texel_by_moving(kSize, face, x, y)];
            const auto found = texel_at(face, direction, inside, 0);
            ASSERT_EQ(Vec3(found[0], found[1], found[2]), linear_colour(texel));
            ASSERT_EQ(found[3], static_cast<float>(texel.a) / 255.0F);
          }
        }
      }
    }
  }
}

TEST(TextureFrame, RepeatsOncePerVoxelOfAQuad) {
  const Texture texture = texture_of(noise(16, 6, false));
  for (const Direction direction : kDirections) {
    const FaceFrame& frame = frame_of(direction);
    for (std::uint8_t turn = 0; turn < 4; ++turn) {
      const VoxelFace face{.texture = texture, .turn = turn, .mirrored = turn % 2 == 1};
      const TextureFrame axes = texture_frame(face, direction);
      Quad quad;
      quad.bits = std::uint64_t{2} << Quad::kSizeUShift | std::uint64_t{4} << Quad::kSizeVShift |
                  static_cast<std::uint64_t>(direction) << Quad::kDirectionShift | 63U | 5U << 6 | 9U << 12;
      const auto uv = [&](int corner) { return texture_coordinates(axes, Vec3(quad.corner(corner) - quad.voxel())); };
      // The sizes along the quad's axes, in textures.
      const float u = std::abs(uv(1)[0] - uv(0)[0]) + std::abs(uv(1)[1] - uv(0)[1]);
      const float v = std::abs(uv(3)[0] - uv(0)[0]) + std::abs(uv(3)[1] - uv(0)[1]);
      EXPECT_EQ(u, 3.0F);
      EXPECT_EQ(v, 5.0F);
      // The coordinates and the lookup agree within each voxel.
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 5; ++j) {
          Vec3 at(quad.corner(0) - quad.voxel());
          at[frame.u] += static_cast<float>(i) + 0.3F;
          at[frame.v] += static_cast<float>(j) + 0.8F;
          const std::array<float, 2> coordinates = texture_coordinates(axes, at);
          const auto texel = [](float share) { return static_cast<int>((share - std::floor(share)) * 16.0F); };
          const Rgba8 expected =
              texture.level(0)[static_cast<std::size_t>(texel(coordinates[1]) * 16 + texel(coordinates[0]))];
          const auto found = texel_at(face, direction, DVec3(at - glm::floor(at)), 0);
          EXPECT_EQ(Vec3(found[0], found[1], found[2]), linear_colour(expected));
        }
      }
    }
  }
}

TEST(TextureFrame, ClampsPositionsAndLevels) {
  const Texture texture = texture_of(noise(16, 6, false));
  const VoxelFace face{texture};
  const double nan = std::nan("");
  // On -Z, the texture runs towards -X and -Y.
  for (const int level : {-3, 0, 2, 4, 99}) {
    const std::span<const Rgba8> texels = texture.level(std::clamp(level, 0, 4));
    const auto colour_at = [&](double all) {
      const auto found = texel_at(face, Direction::NegZ, DVec3(all), level);
      return Vec3(found[0], found[1], found[2]);
    };
    for (const double first : {1.0, 1.0 - 1e-17, 1e300, nan}) EXPECT_EQ(colour_at(first), linear_colour(texels[0]));
    for (const double last : {0.0, 1e-17, -1e300}) EXPECT_EQ(colour_at(last), linear_colour(texels.back()));
  }
}

// Points on the edges of a face belong to this face, so their texels do not wrap.
TEST(TextureFrame, ShowsTexelsOfCornersAtCorners) {
  constexpr std::size_t kSize = 16;
  const Texture texture = texture_of(noise(16, 6, false));
  for (const Direction direction : kDirections) {
    for (std::uint8_t i = 0; i < 8; ++i) {
      const VoxelFace face{.texture = texture, .turn = static_cast<std::uint8_t>(i % 4), .mirrored = i >= 4};
      const TextureFrame frame = texture_frame(face, direction);
      for (const double beyond : {0.0, 1e-9, 3.0}) {
        for (const std::size_t corner : {0U, 1U, 2U, 3U}) {
          const bool is_right = corner % 2 == 1;
          const bool is_low = corner >= 2;
          const DVec3 offset = DVec3(frame.right) * (is_right ? 0.5 : -0.5) + DVec3(frame.down) * (is_low ? 0.5 : -0.5);
          const auto found = texel_at(face, direction, DVec3(0.5) + offset * (1.0 + 2.0 * beyond), 0);
          const std::size_t texel = (is_low ? kSize * (kSize - 1) : 0) + (is_right ? kSize - 1 : 0);
          EXPECT_EQ(Vec3(found[0], found[1], found[2]), linear_colour(texture.level(0)[texel]))
              << name_of(direction) << ", corner " << corner << ", " << beyond << " voxels outside";
        }
      }
    }
  }
}

// ---- faces of types

std::string error_of_type(const VoxelProperties& type) {
  const Status valid = validate_type(type);
  return valid ? "" : valid.error().message;
}

TEST(VoxelFaces, AreRefusedByName) {
  const Texture stone = texture_of(plain(16, {90, 90, 90, 255}), "stone");
  const Texture pane = texture_of(plain(16, {90, 90, 90, 60}), "pane");
  const std::string start = "cannot use voxel type \"a\": faces: the face ";
  EXPECT_EQ(error_of_type({.name = "a", .faces = stone}), "");
  EXPECT_EQ(error_of_type({.name = "a", .faces = {{stone}, {Texture()}, {stone}}}), start + "+Y has no texture");
  EXPECT_EQ(error_of_type({.name = "a", .faces = VoxelFace{.texture = stone, .turn = 4}}),
            start + "+X has a turn that is not 0 to 3");
  EXPECT_EQ(error_of_type({.name = "a", .faces = pane}),
            start + "+X is opaque, but its texture \"pane\" has transparent texels");
  for (const FaceAlpha mode : {FaceAlpha::Cutout, FaceAlpha::Translucent}) {
    const VoxelFace face{.texture = pane, .alpha = mode};
    EXPECT_EQ(error_of_type({.name = "a", .faces = face}), start + "+X is not opaque, which needs a transparent type");
    EXPECT_EQ(error_of_type({.name = "a", .visibility = Visibility::Transparent, .faces = face}), "");
  }
  const VoxelFace unknown{.texture = stone, .alpha = static_cast<FaceAlpha>(7)};
  EXPECT_EQ(error_of_type({.name = "a", .faces = unknown}), start + "+X has an unknown alpha mode");
  VoxelRegistry types;
  EXPECT_FALSE(types.add({.name = "a", .faces = pane}));
  EXPECT_FALSE(types.find_or_add({.name = "a", .faces = {{stone}, {Texture()}, {stone}}}));
  EXPECT_EQ(types.size(), 1U);
}

TEST(VoxelFaces, GiveTypesTheirMeanColour) {
  const Texture red = texture_of(plain(16, {200, 0, 0, 255}));
  const Texture white = texture_of(plain(32, {255, 255, 255, 255}));
  VoxelRegistry types;
  const VoxelType one = types.add({.name = "one", .colour = {1, 2, 3, 4}, .faces = red}).value();
  EXPECT_EQ(types[one].colour, (Rgba8{200, 0, 0, 255}));
  const VoxelFace tinted{.texture = white, .tint = {0, 100, 0, 255}};
  const VoxelType two = types.add({.name = "two", .faces = {tinted, {white}, {white}}}).value();
  const float green = (4.0F * linear_colour({0, 100, 0}).y + 2.0F) / 6.0F;
  EXPECT_EQ(types[two].colour, srgb_colour({2.0F / 6.0F, green, 2.0F / 6.0F}));
  const VoxelFace half{.texture = texture_of(plain(16, {10, 20, 30, 102})), .alpha = FaceAlpha::Translucent};
  VoxelProperties glass{.name = "glass", .visibility = Visibility::Transparent, .faces = half};
  EXPECT_EQ(types[types.add(glass).value()].colour, (Rgba8{10, 20, 30, 102}));
  VoxelFace cut = half;
  cut.alpha = FaceAlpha::Cutout;
  glass.faces = cut;
  EXPECT_EQ(types[types.add(glass).value()].colour, (Rgba8{10, 20, 30, 0})) << "coverage";
  types.replace(one, {.name = "one", .faces = white});
  EXPECT_EQ(types[one].colour, (Rgba8{255, 255, 255, 255}));
}

TEST(VoxelFaces, DistinguishTypes) {
  VoxelRegistry types;
  EXPECT_FALSE(types.has_textures());
  const auto image = noise(16, 5, false);
  const Texture stone = texture_of(image, "stone");
  const VoxelProperties block{.name = "block", .faces = stone};
  const VoxelType first = types.find_or_add(block).value();
  EXPECT_TRUE(types.has_textures());
  EXPECT_EQ(types.find_or_add(block).value(), first);
  EXPECT_EQ(types.find_or_add({.name = "block", .faces = texture_of(image, "stone")}).value(), first) << "equal texels";
  EXPECT_EQ(types.find_or_add(types[first]).value(), first);
  EXPECT_EQ(
      types.find_or_add({.name = "block", .faces = VoxelFace{.texture = stone, .tint = {255, 255, 255, 9}}}).value(),
      first)
      << "the alpha of tints has no effect";
  VoxelProperties plain_block = types[first];
  plain_block.faces = {};
  EXPECT_NE(types.find_or_add(plain_block).value(), first);
  for (const VoxelFace& other :
       {VoxelFace{.texture = stone, .turn = 1}, VoxelFace{.texture = stone, .mirrored = true},
        VoxelFace{.texture = stone, .tint = {1, 2, 3, 255}}, VoxelFace{.texture = texture_of(image, "other")}}) {
    const std::size_t before = types.size();
    EXPECT_EQ(types.find_or_add({.name = "block", .faces = other}).value(), before);
  }
}

TEST(VoxelFaces, FindsTypesOfOneColour) {
  VoxelRegistry types;
  const Texture texture = texture_of(noise(16, 5, false));
  const auto block = [&](unsigned i) {
    std::array<VoxelFace, 6> faces;
    for (VoxelFace& face : faces) {
      face.texture = texture;
      face.turn = static_cast<std::uint8_t>(i % 4);
      face.mirrored = i / 4 % 2 == 1;
      i /= 8;
    }
    return VoxelProperties{.name = "block", .faces = VoxelFaces(faces)};
  };
  for (const bool again : {false, true}) {
    for (unsigned i = 0; i < 512; ++i) EXPECT_EQ(types.find_or_add(block(i)).value(), i + 1) << again;
  }
  types.replace(7, block(600));
  EXPECT_EQ(types.find_or_add(block(600)).value(), 7);
  EXPECT_EQ(types.find_or_add(block(6)).value(), 513);
}

TEST(VoxelFaces, ShareEqualTextures) {
  VoxelRegistry types;
  const auto made = [](unsigned seed) { return texture_of(noise(16, seed, false), "same"); };
  const auto texels_of = [&](VoxelType type, Direction direction) {
    return types[type].faces[direction].texture.level(0).data();
  };
  const Texture first = made(1);
  const VoxelType a = types.add({.name = "a", .faces = first}).value();
  const VoxelType b = types.add({.name = "b", .faces = {{made(2)}, {made(1)}, {made(2)}}}).value();
  EXPECT_EQ(texels_of(a, Direction::PosX), first.level(0).data());
  EXPECT_EQ(texels_of(b, Direction::PosY), first.level(0).data());
  EXPECT_EQ(texels_of(b, Direction::NegY), texels_of(b, Direction::PosX)) << "within a type";
  const VoxelRegistry copy = types;
  types.replace(a, {.name = "a"});
  types.replace(b, {.name = "b", .faces = made(2)});
  const Texture later = made(1);
  const VoxelType c = types.add({.name = "c", .faces = later}).value();
  EXPECT_EQ(texels_of(c, Direction::PosX), later.level(0).data()) << "no type used the first one any more";
  EXPECT_EQ(copy[b].faces[Direction::PosY].texture.level(0).data(), first.level(0).data());
  types.replace(c, types[c]);
  EXPECT_EQ(texels_of(c, Direction::PosX), later.level(0).data());
}

TEST(VoxelFaces, AreReportedAndCounted) {
  VoxelRegistry types;
  const VoxelType stone = types.add({.name = "stone", .colour = {7, 7, 7, 255}}).value();
  ChangeCursor cursor = types.cursor();
  VoxelProperties textured = types[stone];
  textured.faces = texture_of(plain(16, {7, 7, 7, 255}));
  types.replace(stone, textured);
  const TypeChanges changes = types.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_TRUE(changes.items_unless_all()[0].colour_changed) << "faces of the same colour";
  const VoxelRegistry snapshot = types;
  types.replace(stone, {.name = "stone"});
  EXPECT_FALSE(types.has_textures());
  EXPECT_TRUE(snapshot.has_textures() && !snapshot[stone].faces.empty());
  types.replace(stone, textured);
  types.replace(stone, textured);
  EXPECT_TRUE(types.has_textures());
}

}  // namespace
}  // namespace quoin
