#include "convert/convert.h"

#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace quoin::tool {

namespace {

/// Parses options of triangle meshes. Returns the usage error, or "".
std::string read(const std::string& line, MeshLoadOptions& options) {
  CLI::App command;
  add_mesh_input_options(command, options);
  try {
    command.parse(line);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  const Status fits = check_rules(command, mesh_input_rules());
  return fits ? "" : to_string(fits.error());
}

MeshLoadOptions options_of(const std::string& line) {
  MeshLoadOptions options;
  EXPECT_EQ(read(line, options), "") << line;
  return options;
}

TEST(MeshInput, SelectsSurfaceAndInside) {
  EXPECT_EQ(options_of("").surface, SurfaceVoxels::Separating6);
  EXPECT_EQ(options_of("").solid, SolidVoxels::Winding);
  EXPECT_EQ(options_of("--separating 26").surface, SurfaceVoxels::Separating26);
  EXPECT_EQ(options_of("--solid --parity").surface, SurfaceVoxels::None);
  EXPECT_EQ(options_of("--solid --parity").solid, SolidVoxels::Parity);
  EXPECT_EQ(options_of("--surface --separating 6").solid, SolidVoxels::None);
}

TEST(MeshInput, ReadsSizesAndAxes) {
  EXPECT_EQ(options_of("--size 200").size, 200);
  EXPECT_EQ(options_of("--voxel 0.5").voxel_size, 0.5);
  EXPECT_EQ(options_of("--field --band 4").band, 4.0F);
  EXPECT_TRUE(options_of("--field").as_field);
  EXPECT_EQ(options_of("--max-colours 9").max_types, 9U);
  EXPECT_EQ(options_of("").up, std::nullopt);
  EXPECT_EQ(options_of("--input-up z").up, UpAxis::Z);
}

TEST(MeshInput, RefusesOptionsThatContradictEachOther) {
  for (const auto& [line, fault] : std::vector<std::pair<std::string, std::string>>{
           {"--size 3 --voxel 1", "--size and --voxel cannot be used together"},
           {"--solid --surface", "--solid and --surface cannot be used together"},
           {"--parity --surface", "--parity and --surface cannot be used together"},
           {"--field --separating 6", "--field and --separating cannot be used together"},
           {"--solid --separating 26", "--separating and --solid cannot be used together"},
           {"--band 3", "--band needs --field"},
           {"--separating 7", "--separating: 7 not in {6,26}"}}) {
    MeshLoadOptions options;
    EXPECT_EQ(read(line, options), fault) << line;
  }
}

}  // namespace

}  // namespace quoin::tool
