// Writes blocks of 16^3 voxels as images, each once; materials; and layers that place blocks. A layer has one material,
// so an instance of several materials becomes several layers.

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <quoin/core/thousands.h>

#include "core/progress_steps.h"
#include "io/byte_writer.h"
#include "io/image/png.h"
#include "io/models/write/write_models.h"
#include "io/placed/placed_grids.h"

namespace quoin::models {

namespace {

constexpr FormatHolds kHolds = {
    .extension = ".gox", .names = true, .hidden = true, .several = true, .transparency = true, .materials = true};
constexpr std::uint32_t kVersion = 2;
constexpr int kBlockEdge = 16;
constexpr std::size_t kBlockBytes = std::size_t{4} * kBlockEdge * kBlockEdge * kBlockEdge;

/// The material of a layer; colours belong to voxels.
struct Material {
  float metalness = 0.0F;
  float roughness = 1.0F;
  float emission = 0.0F;
  std::uint8_t alpha = 255;
  auto operator<=>(const Material&) const = default;
};

struct Block {
  std::uint32_t image = 0;
  IVec3 place{0};  ///< in the file's axes
};

class GoxelWriter {
 public:
  explicit GoxelWriter(const Scene& scene) : scene_(scene), colours_(colours_of(scene.types)) {
    for (std::size_t i = 0; i < colours_.size(); ++i) {
      const VoxelProperties& type = scene.types[static_cast<VoxelType>(i)];
      const Material material{type.metalness, type.roughness, type.emission, colours_[i].a};
      const auto [found, is_new] = numbers_.try_emplace(material, static_cast<std::uint32_t>(numbers_.size()));
      if (is_new) materials_.push_back(material);
      material_of_.push_back(found->second);
    }
    out_.text("GOX ");
    out_.u32(kVersion);
  }

  Result<ModelBytes> run(const Progress& progress);

 private:
  using Layer = std::pair<std::uint32_t, std::vector<Block>>;  // of a material
  [[nodiscard]] std::size_t begin_chunk(std::string_view id);
  void end_chunk(std::size_t begin);
  void entry(std::string_view key, std::span<const std::byte> value);
  void numbers(std::string_view key, std::span<const float> values);
  void end_entries() { out_.u32(0); }
  Status add_blocks(IVec3 chunk, const Chunk& voxels, std::map<std::uint32_t, std::vector<Block>>& layers);
  Result<std::uint32_t> index_of_image(const std::vector<std::uint8_t>& pixels);
  void write_materials();
  void write_layer(const PlacedGrid& grid, const Layer& layer, std::uint32_t id);

  const Scene& scene_;
  std::vector<Rgba8> colours_;
  std::map<Material, std::uint32_t> numbers_;
  std::vector<Material> materials_;
  std::vector<std::uint32_t> material_of_;                 // materials by type
  std::unordered_map<std::string, std::uint32_t> images_;  // blocks by their pixels
  ByteWriter out_;
};

// The checksum after the content is 0: no program checks it.
std::size_t GoxelWriter::begin_chunk(std::string_view id) {
  out_.text(id);
  out_.u32(0);
  return out_.size();
}

void GoxelWriter::end_chunk(std::size_t begin) {
  out_.patch(begin - 4, out_.size() - begin);
  out_.u32(0);
}

void GoxelWriter::entry(std::string_view key, std::span<const std::byte> value) {
  out_.u32(static_cast<std::uint32_t>(key.size()));
  out_.text(key);
  out_.u32(static_cast<std::uint32_t>(value.size()));
  out_.raw(value);
}

void GoxelWriter::numbers(std::string_view key, std::span<const float> values) {
  ByteWriter bytes;
  for (const float value : values) bytes.f32(value);
  entry(key, bytes.bytes());
}

Result<std::uint32_t> GoxelWriter::index_of_image(const std::vector<std::uint8_t>& pixels) {
  std::string key(pixels.begin(), pixels.end());
  const auto found = images_.find(key);
  if (found != images_.end()) return found->second;
  constexpr std::uint32_t kEdge = 64;
  const auto png = encode_png({kEdge, kEdge, 4, pixels}, PngEffort::Quick);
  if (!png) return png.error();
  const std::size_t begin = begin_chunk("BL16");
  out_.raw(*png);
  end_chunk(begin);
  const auto number = static_cast<std::uint32_t>(images_.size());
  images_.emplace(std::move(key), number);
  return number;
}

/// The file's axes are x, -z and y. Chunks are whole blocks in these axes too.
Status GoxelWriter::add_blocks(IVec3 chunk, const Chunk& voxels, std::map<std::uint32_t, std::vector<Block>>& layers) {
  const IVec3 origin = chunk * kChunkEdge;
  std::array<VoxelType, kChunkEdge> row{};
  for (int bz = 0; bz < kChunkEdge; bz += kBlockEdge) {
    for (int by = 0; by < kChunkEdge; by += kBlockEdge) {
      std::array<std::map<std::uint32_t, std::vector<std::uint8_t>>, kChunkEdge / kBlockEdge> blocks;
      for (int i = 0; i < kBlockEdge * kBlockEdge; ++i) {
        const int y = by + i / kBlockEdge;
        const int z = bz + i % kBlockEdge;
        voxels.read_row(y, z, row);
        for (int x = 0; x < kChunkEdge; ++x) {
          const VoxelType type = row[static_cast<std::size_t>(x)];
          if (type == kAir) continue;
          auto& pixels = blocks.at(static_cast<std::size_t>(x / kBlockEdge))[material_of_[type]];
          pixels.resize(kBlockBytes);
          const int in_file = x % kBlockEdge + kBlockEdge * (kBlockEdge - 1 - i % kBlockEdge) +
                              kBlockEdge * kBlockEdge * (i / kBlockEdge);
          const Rgba8 colour = colours_[type];
          const std::array<std::uint8_t, 4> rgba = {colour.r, colour.g, colour.b, 255};
          std::copy(rgba.begin(), rgba.end(), pixels.begin() + std::ptrdiff_t{4} * in_file);
        }
      }
      for (std::size_t bx = 0; bx < blocks.size(); ++bx) {
        for (const auto& [material, pixels] : blocks.at(bx)) {
          const auto image = index_of_image(pixels);
          if (!image) return image.error();
          const IVec3 place = origin + IVec3(static_cast<int>(bx) * kBlockEdge, by, bz);
          layers[material].push_back({*image, {place.x, -place.z - kBlockEdge, place.y}});
        }
      }
    }
  }
  return {};
}

void GoxelWriter::write_materials() {
  for (const Material& material : materials_) {
    const std::size_t begin = begin_chunk("MATE");
    const std::string name = "material " + std::to_string(numbers_.at(material));
    entry("name", std::as_bytes(std::span(name)));
    const std::array<float, 4> colour = {1.0F, 1.0F, 1.0F, static_cast<float>(material.alpha) / 255.0F};
    const std::array<float, 3> emission = {material.emission, material.emission, material.emission};
    numbers("color", colour);
    numbers("metallic", std::span(&material.metalness, 1));
    numbers("roughness", std::span(&material.roughness, 1));
    numbers("emission", emission);
    end_entries();
    end_chunk(begin);
  }
}

void GoxelWriter::write_layer(const PlacedGrid& grid, const Layer& layer, std::uint32_t id) {
  const std::size_t begin = begin_chunk("LAYR");
  out_.u32(static_cast<std::uint32_t>(layer.second.size()));
  for (const Block& block : layer.second) {
    out_.u32(block.image);
    for (int axis = 0; axis < 3; ++axis) out_.i32(block.place[axis]);
    out_.u32(0);
  }
  entry("name", std::as_bytes(std::span(grid.name)));
  std::array<float, 16> identity{};
  for (std::size_t i = 0; i < 4; ++i) identity.at(5 * i) = 1.0F;
  numbers("mat", identity);
  const auto number = [&](std::string_view key, std::uint32_t value) {
    ByteWriter bytes;
    bytes.u32(value);
    entry(key, bytes.bytes());
  };
  number("id", id);
  number("base_id", 0);
  number("material", layer.first);
  const auto visible = static_cast<std::byte>(grid.visible);
  entry("visible", std::span(&visible, 1));
  end_entries();
  end_chunk(begin);
}

Result<ModelBytes> GoxelWriter::run(const Progress& progress) {
  auto placed = place_grids(scene_, kHolds);
  if (!placed) return placed.error();
  std::vector<std::pair<const PlacedGrid*, Layer>> layers;
  std::int64_t split = 0;
  std::size_t chunks = 0;
  for (const PlacedGrid& grid : placed->grids) chunks += grid.voxels.chunk_count();
  ProgressSteps steps(progress, std::max<std::size_t>(chunks, 1));
  for (const PlacedGrid& grid : placed->grids) {
    std::map<std::uint32_t, std::vector<Block>> of_grid;
    for (const IVec3 chunk : grid.voxels.chunks()) {
      if (auto done = add_blocks(chunk, *grid.voxels.find_chunk(chunk), of_grid); !done) return done.error();
      steps.step();
      if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    }
    if (of_grid.empty()) of_grid[0] = {};
    split += of_grid.size() > 1 ? 1 : 0;
    for (auto& layer : of_grid) layers.emplace_back(&grid, std::move(layer));
  }
  if (split != 0) {
    placed->warnings.push_back("instances split into several layers, since a layer has one material: " +
                               with_thousands(split));
  }
  write_materials();
  for (std::size_t i = 0; i < layers.size(); ++i) {
    write_layer(*layers[i].first, layers[i].second, static_cast<std::uint32_t>(i + 1));
  }
  return ModelBytes{out_.take(), std::move(placed->warnings)};
}

}  // namespace

Result<ModelBytes> write_goxel(const Scene& scene, const Progress& progress) {
  return GoxelWriter(scene).run(progress);
}

}  // namespace quoin::models
