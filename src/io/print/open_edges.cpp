#include <algorithm>
#include <array>
#include <bit>
#include <unordered_map>
#include <vector>

#include <quoin/io/mesh_file.h>

namespace quoin {

namespace {

struct Bits {
  std::array<std::uint32_t, 3> of;
  bool operator==(const Bits&) const = default;
};

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E37'79B9'7F4A'7C15U;
  return hash ^ hash >> 29;
}

struct BitsHash {
  std::size_t operator()(const Bits& bits) const { return mixed(mixed(bits.of[0], bits.of[1]), bits.of[2]); }
};

struct KeyHash {
  std::size_t operator()(std::uint64_t key) const { return mixed(key, key >> 32); }
};

/// The uses of an edge, by direction.
struct Uses {
  std::uint32_t there = 0;
  std::uint32_t back = 0;
};

std::uint64_t open_edges_of(const MeshPart& part) {
  std::unordered_map<Bits, std::uint32_t, BitsHash> numbers;
  std::unordered_map<std::uint64_t, Uses, KeyHash> edges;
  const auto number_of = [&](const Vec3& at) {
    // 0 and -0 are the same position.
    const Bits bits{{std::bit_cast<std::uint32_t>(at.x + 0.0F), std::bit_cast<std::uint32_t>(at.y + 0.0F),
                     std::bit_cast<std::uint32_t>(at.z + 0.0F)}};
    return numbers.try_emplace(bits, static_cast<std::uint32_t>(numbers.size())).first->second;
  };
  for (const MeshView& view : part.surfaces) {
    for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
      std::array<std::uint32_t, 3> corner{};
      for (std::size_t k = 0; k < 3; ++k) corner[k] = number_of(view.positions[view.indices[i + k]]);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = corner[k];
        const std::uint32_t to = corner[(k + 1) % 3];
        Uses& uses = edges[std::uint64_t{std::min(from, to)} << 32 | std::max(from, to)];
        ++(from < to ? uses.there : uses.back);
      }
    }
  }
  std::uint64_t open = 0;
  for (const auto& [edge, uses] : edges) open += uses.there == 1 && uses.back == 1 ? 0 : 1;
  return open;
}

}  // namespace

std::uint64_t count_open_edges(const SceneMeshes& meshes) {
  std::vector<std::uint64_t> of_part(meshes.parts.size());
  std::vector<bool> is_known(meshes.parts.size());
  std::uint64_t open = 0;
  for (const MeshPlacement& placement : meshes.placements) {
    if (!is_known[placement.part]) of_part[placement.part] = open_edges_of(meshes.parts[placement.part]);
    is_known[placement.part] = true;
    open += of_part[placement.part];
  }
  return open;
}

}  // namespace quoin
