#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include <quoin/grid/density_grid.h>
#include <quoin/mesh/smooth.h>

#include "grid/change_follower_for_tests.h"

namespace quoin {
namespace {

using Place = std::tuple<int, int, int>;

template <class T>
void append_bytes(const Buffer<T>& values, std::string& out) {
  out.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  out.push_back('|');
}

/// The mesh bytes of every chunk that could hold a surface.
class Meshes {
 public:
  explicit Meshes(const SmoothOptions& options) : options_(options) {}

  std::map<Place, std::string> all(const DensityGrid& grid) {
    std::map<Place, std::string> bytes;
    for (const IVec3 at : grid.chunks()) {
      for (int i = 0; i < 27; ++i) {
        const IVec3 chunk = at + IVec3{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        const Place place{chunk.x, chunk.y, chunk.z};
        if (!bytes.contains(place)) bytes[place] = mesh(grid, chunk);
      }
    }
    std::erase_if(bytes, [](const auto& entry) { return entry.second.empty(); });
    return bytes;
  }

 private:
  std::string mesh(const DensityGrid& grid, IVec3 chunk) {
    mesher_.mesh(grid.neighbourhood(chunk), options_, mesh_);
    std::string bytes;
    if (mesh_.indices.empty() && mesh_.positions.empty()) return bytes;
    append_bytes(mesh_.positions, bytes);
    append_bytes(mesh_.normals, bytes);
    append_bytes(mesh_.occlusion, bytes);
    append_bytes(mesh_.cells, bytes);
    append_bytes(mesh_.indices, bytes);
    return bytes;
  }

  SmoothOptions options_;
  SmoothMesher mesher_;
  SmoothChunkMesh mesh_;
};

void edit_somewhere(DensityGrid& grid, std::mt19937& random) {
  const auto place = [&] { return -70.0 + 140.0 * (random() / 4294967296.0); };
  const DVec3 centre{place(), place(), place()};
  const double radius = 1.0 + static_cast<double>(random() % 15);
  switch (random() % 4) {
    case 0:
      grid.add_sphere(centre, radius, 1, 2.0);
      break;
    case 1:
      grid.remove_sphere(centre, radius);
      break;
    case 2:
      grid.smooth(centre, radius, 1.0);
      break;
    default:
      grid.set(IVec3(centre), {static_cast<float>(random() % 5) - 2.0F, 2});
  }
}

// Edits report every chunk whose mesh they changed, with any meshed occlusion.
TEST(DensityEdits, ReportsEveryMeshChange) {
  constexpr unsigned kSeed = 41;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  for (const float spread : {0.0F, 1.0F, 2.0F, 5.5F}) {
    SCOPED_TRACE(spread);
    SmoothOptions options;
    options.split_sheets = false;
    options.occlusion.method = spread == 0.0F ? SmoothOcclusion::None : SmoothOcclusion::Weighted;
    if (spread > 0.0F) options.occlusion.spread = spread;
    Meshes meshes(options);
    DensityGrid grid;
    grid.add_box({-90, -90, -90}, {90, 3, 90}, 1);
    std::map<Place, std::string> before = meshes.all(grid);
    ChangeFollower follower(grid);
    int changed = 0;
    for (int round = 0; round < 8; ++round) {
      edit_somewhere(grid, random);
      std::set<Place> reported;
      for (const IVec3 at : follower.take(grid, reach_of(options.occlusion))) reported.emplace(at.x, at.y, at.z);
      std::map<Place, std::string> after = meshes.all(grid);
      for (const auto& [at, bytes] : after) before.try_emplace(at);
      for (const auto& [at, bytes] : before) {
        const auto now = after.find(at);
        if ((now == after.end() ? std::string() : now->second) == bytes) continue;
        ++changed;
        EXPECT_TRUE(reported.contains(at)) << std::get<0>(at) << ' ' << std::get<1>(at) << ' ' << std::get<2>(at);
      }
      before = std::move(after);
    }
    EXPECT_GT(changed, 0);
  }
}

}  // namespace
}  // namespace quoin
