#include "io/gltf/gltf_decoders.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>

#include "core/bytes/text.h"
#include "io/gltf/gltf_for_tests.h"
#include "io/gltf/gltf_layout.h"

namespace quoin {
namespace {

bool reads_and_writes() {
  return can(FileFormat::Glb, FormatCapability::Read) && can_compress_gltf();
}

std::vector<std::byte> castle(bool quantize, bool compress) {
  Scene scene;
  const GridHandle grid = add_asymmetric_grid(scene, "castle");
  (void)place(scene, grid, {3.0, -2.0, 1.0}, "castle");
  (void)place(scene, grid, {-9.0, 5.0, 0.5}, "another");
  const auto meshes = mesh_scene(scene, {});
  EXPECT_TRUE(meshes.has_value());
  MeshFileOptions options;
  options.quantize = quantize;
  options.compress = compress;
  auto bytes = write_mesh(*meshes, FileFormat::Glb, options);
  EXPECT_TRUE(bytes.has_value());
  return std::move(*bytes);
}

using Triangle = std::array<std::array<double, 3>, 3>;

/// Each triangle starts at its least corner, and triangles are sorted: the codec rotates triangles and may reorder
/// them.
std::vector<Triangle> triangles_of(const TriangleMesh& mesh) {
  std::vector<Triangle> all;
  for (const auto& corners : mesh.triangles) {
    Triangle triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      const DVec3& p = mesh.positions[corners[i]];
      triangle[i] = {p.x, p.y, p.z};
    }
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    all.push_back(triangle);
  }
  std::sort(all.begin(), all.end());
  return all;
}

TEST(GltfMeshopt, ReadsCompressedMeshesLikeUncompressedMeshes) {
  if (!reads_and_writes()) GTEST_SKIP() << "this build has no tinygltf or no meshoptimizer";
  for (const bool quantize : {false, true}) {
    const auto plain = read_mesh(castle(quantize, false));
    const auto packed = read_mesh(castle(quantize, true));
    ASSERT_TRUE(plain) << to_string(plain.error());
    ASSERT_TRUE(packed) << to_string(packed.error());
    EXPECT_FALSE(plain->mesh.triangles.empty());
    EXPECT_EQ(triangles_of(packed->mesh), triangles_of(plain->mesh));
    EXPECT_EQ(packed->mesh.materials.size(), plain->mesh.materials.size());
    EXPECT_EQ(packed->warnings, plain->warnings);
  }
}

// 64 views of one encoded buffer that decodes to a mebibyte.
TEST(GltfMeshopt, LimitsRepeatedDecodingOfOneBuffer) {
  if (!reads_and_writes()) GTEST_SKIP() << "this build has no tinygltf or no meshoptimizer";
  const std::vector<std::byte> zeros(std::size_t{1} << 20);
  GltfArray array;
  array.kind = GltfArrayKind::Position;
  array.stride = 16;
  const auto code = compress_gltf_array(array, zeros);
  std::string views;
  for (int i = 0; i < 64; ++i) {
    views.append(i == 0 ? "" : ",")
        .append(R"({"buffer":0,"byteLength":1048576,"byteStride":16,"extensions":{"EXT_meshopt_compression":)")
        .append(R"({"buffer":0,"byteLength":)")
        .append(std::to_string(code.size()))
        .append(R"(,"byteStride":16,"count":65536,"mode":"ATTRIBUTES"}}})");
  }
  const std::string json = R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_meshopt_compression"],"buffers":[)"
                           R"({"byteLength":)" +
                           std::to_string(code.size()) + R"(,"uri":"data:application/octet-stream;base64,)" +
                           to_base64(code) + R"("}],"bufferViews":[)" + views + "]}";
  const auto loaded = read_mesh(std::as_bytes(std::span(json.data(), json.size())));
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().message.find("than the compressed data can hold"), std::string::npos)
      << loaded.error().message;
}

/// Replaces text of the file's JSON by text of the same length.
std::vector<std::byte> with(std::vector<std::byte> file, std::string_view old, std::string_view text) {
  const auto from = std::as_bytes(std::span(old));
  const auto found = std::search(file.begin(), file.end(), from.begin(), from.end());
  EXPECT_NE(found, file.end()) << old;
  EXPECT_EQ(old.size(), text.size());
  if (found != file.end()) std::copy_n(std::as_bytes(std::span(text)).begin(), text.size(), found);
  return file;
}

TEST(GltfMeshopt, RefusesContradictoryCompressedViews) {
  if (!reads_and_writes()) GTEST_SKIP() << "this build has no tinygltf or no meshoptimizer";
  const auto file = castle(true, true);
  const std::pair<std::string_view, std::string_view> lies[] = {
      {R"("mode":"ATTRIBUTES")", R"("mode":"TRIANGLES" )"},
      {R"("mode":"TRIANGLES")", R"("mode":"TRIANGLEX")"},
      {R"("EXT_meshopt_compression":{"buffer":0)", R"("EXT_meshopt_compression":{"buffer":9)"},
      {R"("mode":"TRIANGLES")", R"("mode":"INDICES"  )"},
  };
  for (const auto& [old, text] : lies) {
    const auto loaded = read_mesh(with(file, old, text));
    ASSERT_FALSE(loaded) << text;
    EXPECT_EQ(loaded.error().code, ErrorCode::BadFormat) << text;
    EXPECT_NE(loaded.error().message.find("buffer view"), std::string::npos) << loaded.error().message;
  }
  // Without a declared fallback the file's own buffer counts.
  const auto own = castle(true, false);
  const auto named = with(own, R"({"byteLength":)", R"({"bytelength":)");
  EXPECT_FALSE(read_mesh(named)) << "no length";
  // Truncated code and other bytes give an error or other numbers, with no access out of bounds.
  for (std::size_t at = file.size() - 200; at < file.size(); at += 7) {
    auto damaged = file;
    damaged[at] ^= std::byte{0xFF};
    (void)read_mesh(damaged);
  }
}

}  // namespace
}  // namespace quoin
