#include "io/vox/vox_reader.h"

#include <gtest/gtest.h>

namespace quoin::vox {
namespace {

constexpr Rgba8 kRed{200, 10, 20, 255};

VoxelProperties decoded(const Attributes& attributes) {
  return decode_material("palette 1", kRed, attributes);
}

TEST(VoxMaterial, IsDiffuseWithoutType) {
  const VoxelProperties p = decoded({{"_rough", "0.1"}, {"_metal", "0.8"}, {"_emit", "1"}, {"_trans", "0.5"}});
  EXPECT_EQ(p.visibility, Visibility::Opaque);
  EXPECT_EQ(p.roughness, 1.0F);
  EXPECT_EQ(p.metalness, 0.0F);
  EXPECT_EQ(p.emission, 0.0F);
  EXPECT_EQ(p.colour, kRed);
  EXPECT_EQ(p.attributes.size(), 4U);
}

TEST(VoxMaterial, ReadsMetalnessFromMetalOrWeight) {
  EXPECT_EQ(decoded({{"_type", "_metal"}, {"_metal", "0.25"}, {"_rough", "0.5"}}).metalness, 0.25F);
  EXPECT_EQ(decoded({{"_type", "_metal"}, {"_metal", "0.25"}, {"_rough", "0.5"}}).roughness, 0.5F);
  EXPECT_EQ(decoded({{"_type", "_metal"}, {"_weight", "0.75"}}).metalness, 0.75F);
  EXPECT_EQ(decoded({{"_type", "_metal"}}).metalness, 1.0F);
  EXPECT_EQ(decoded({{"_type", "_metal"}}).roughness, 0.1F);
  EXPECT_EQ(decoded({{"_type", "_metal"}, {"_plastic", "1"}}).metalness, 0.0F);
}

TEST(VoxMaterial, GlassIsTransparentButVisible) {
  const VoxelProperties p = decoded({{"_type", "_glass"}, {"_trans", "0.2"}, {"_ri", "1.3"}});
  EXPECT_EQ(p.visibility, Visibility::Transparent);
  EXPECT_EQ(p.colour.a, 204);
  EXPECT_EQ(p.ior, 1.3F);
  EXPECT_EQ(decoded({{"_type", "_glass"}, {"_alpha", "0.2"}}).colour.a, 204);
  EXPECT_EQ(decoded({{"_type", "_glass"}, {"_weight", "0.2"}}).colour.a, 204);
  EXPECT_EQ(decoded({{"_type", "_glass"}}).colour.a, 128);
  EXPECT_EQ(decoded({{"_type", "_glass"}, {"_trans", "1"}}).colour.a, 26);
  EXPECT_EQ(decoded({{"_type", "_media"}}).visibility, Visibility::Transparent);
  EXPECT_EQ(decoded({{"_type", "_blend"}, {"_metal", "0.5"}}).visibility, Visibility::Opaque);
  EXPECT_EQ(decoded({{"_type", "_blend"}, {"_alpha", "0.5"}}).visibility, Visibility::Transparent);
}

TEST(VoxMaterial, EmissionDoublesWithEachStepOfFlux) {
  EXPECT_EQ(decoded({{"_type", "_emit"}, {"_emit", "0.5"}}).emission, 0.5F);
  EXPECT_EQ(decoded({{"_type", "_emit"}, {"_emit", "0.5"}, {"_flux", "3"}}).emission, 4.0F);
  EXPECT_EQ(decoded({{"_type", "_emit"}, {"_weight", "0.25"}}).emission, 0.25F);
  EXPECT_EQ(decoded({{"_type", "_emit"}}).emission, 1.0F);
}

TEST(VoxMaterial, ToleratesInvalidNumbers) {
  const VoxelProperties p =
      decoded({{"_type", "_metal"}, {"_metal", "-7"}, {"_rough", "1e30"}, {"_ior", "nan"}, {"_spec", "x"}});
  EXPECT_EQ(p.metalness, 0.0F);
  EXPECT_EQ(p.roughness, 1.0F);
  EXPECT_EQ(p.ior, 1.5F);
  EXPECT_EQ(decoded({{"_type", "_emit"}, {"_flux", "1e9"}}).emission, 65536.0F);
}

TEST(VoxMaterial, WritesUntouchedAttributesUnchanged) {
  const Attributes original = {{"_type", "_glass"}, {"_trans", "0.500"}, {"_att", "0.02"}, {"_unknown", "7"}};
  EXPECT_EQ(encode_material("palette 1", decoded(original)), original);
}

TEST(VoxMaterial, EditedPropertiesOverrideAttributes) {
  VoxelProperties p = decoded({{"_type", "_glass"}, {"_trans", "0.5"}, {"_att", "0.02"}});
  p.visibility = Visibility::Opaque;
  p.colour.a = 255;
  p.metalness = 0.5F;
  const Attributes written = encode_material("palette 1", p);
  EXPECT_EQ(written.at("_type"), "_metal");
  EXPECT_EQ(written.at("_att"), "0.02");
  EXPECT_FALSE(written.contains("_trans"));
  p.attributes = written;
  EXPECT_EQ(decoded(written), p);
}

TEST(VoxMaterial, WritesNoMaterialForPlainType) {
  VoxelProperties p;
  p.name = "palette 1";
  p.colour = kRed;
  EXPECT_TRUE(encode_material("palette 1", p).empty());
}

TEST(VoxMaterial, RoundTripsLightAndOcclusion) {
  for (const Visibility visibility : {Visibility::Opaque, Visibility::Transparent}) {
    VoxelProperties p{.name = "palette 1", .colour = kRed, .visibility = visibility, .light_cost = 3};
    p.blocks_light = visibility == Visibility::Transparent;
    if (visibility == Visibility::Opaque) p.occludes = false;
    p.attributes = encode_material("palette 1", p);
    EXPECT_EQ(decode_material("palette 1", p.colour, p.attributes), p);
    p.attributes["_quoin_occludes"] = "1";
    p.attributes["_quoin_light_cost"] = "99";
    EXPECT_TRUE(validate_type(decode_material("palette 1", p.colour, p.attributes)));
  }
}

TEST(VoxMaterial, KeepsMarkOfTypesWhoseDataChangesMeshes) {
  VoxelProperties p;
  p.name = "palette 1";
  p.colour = kRed;
  p.remesh_on_data = true;
  const Attributes written = encode_material("palette 1", p);
  EXPECT_EQ(written.size(), 1U);
  EXPECT_TRUE(decode_material("palette 1", p.colour, written).remesh_on_data);
}

TEST(VoxMaterial, RoundTripsEveryPropertyCombination) {
  for (const Visibility visibility : {Visibility::Opaque, Visibility::Transparent}) {
    for (const float metalness : {0.0F, 0.3F, 1.0F}) {
      for (const float emission : {0.0F, 0.1F, 1.0F, 3.7F, 1e9F}) {
        for (const float roughness : {0.0F, 0.1F, 0.77F, 1.0F}) {
          for (const int alpha : {0, 25, 26, 128, 255}) {
            VoxelProperties p{"lamp",     {1, 2, 3, static_cast<std::uint8_t>(alpha)},
                              visibility, false,
                              roughness,  metalness,
                              emission,   1.77F,
                              {}};
            p.attributes = encode_material("palette 1", p);
            EXPECT_EQ(decode_material("palette 1", p.colour, p.attributes), p);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace quoin::vox
