#pragma once

#include <unistd.h>

#include <filesystem>
#include <random>
#include <string>

#include <quoin/grid/grid.h>
#include <quoin/store/world_store.h>

// Shared by the tests of worlds.

namespace quoin {

/// A temporary folder, deleted at the end.
class WorldFolder {
 public:
  WorldFolder() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("quoin_world_" + std::to_string(::getpid()) + "_" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  WorldFolder(const WorldFolder&) = delete;
  WorldFolder& operator=(const WorldFolder&) = delete;
  ~WorldFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline VoxelProperties coloured_type(std::uint8_t red) {
  VoxelProperties properties;
  properties.name = "type " + std::to_string(red);
  properties.colour = {red, 100, 50, 255};
  properties.state_bits = 8;
  return properties;
}

/// `count` types.
inline VoxelRegistry coloured_types(int count) {
  VoxelRegistry types;
  for (int i = 1; i <= count; ++i) static_cast<void>(types.add(coloured_type(static_cast<std::uint8_t>(i))).value());
  return types;
}

/// A chunk of boxes of types 1 to `types`, by a seed.
inline Chunk random_chunk(std::uint32_t seed, int types) {
  std::minstd_rand random(seed + 1);
  const auto number = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  Chunk chunk(kAir);
  for (int i = 0; i < 6; ++i) {
    const IVec3 min{number(60), number(60), number(60)};
    const IVec3 max = min + IVec3(1 + number(20), 1 + number(20), 1 + number(20));
    chunk.fill_box({min, max}, static_cast<VoxelType>(1 + number(types)), [](int, int, std::uint64_t) {});
  }
  chunk.set_data({1, 2, 3}, {});
  return chunk;
}

}  // namespace quoin
