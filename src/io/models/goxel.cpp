// Goxel files: chunks of a type, a size, content and a checksum. Goxel's z points up; +x, +z, -y are this library's
// axes.
//
//   BL16   16^3 voxels as a PNG of 64 x 64 pixels
//   MATE   a material
//   LAYR   a layer: its blocks with their positions, and its properties; without blocks a shape in the box from -1 to
//          1 (`mat` places it)
//
// Writes blocks of 16^3 voxels as images, each once; materials; and layers that place blocks. A layer has one material,
// so an instance of several materials becomes several layers.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>

#include "core/bytes/bytes.h"
#include "core/work/progress_steps.h"
#include "io/format_driver.h"
#include "io/image/image_codecs.h"
#include "io/models/model_builder.h"
#include "io/placed_grids.h"

namespace quoin::models {

namespace {

constexpr std::string_view kMagic = "GOX ";
constexpr int kBlockEdge = 16;
constexpr std::size_t kBlockBytes = std::size_t{4} * kBlockEdge * kBlockEdge * kBlockEdge;
constexpr std::int32_t kMaxGoxelPlace = 1 << 26;

class GoxelReader {
 public:
  explicit GoxelReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  Result<LoadedScene> read();

 private:
  using Dict = std::map<std::string, std::span<const std::byte>, std::less<>>;
  struct Material {
    VoxelProperties properties;
    std::uint32_t number = 0;
    std::array<float, 4> colour{1.0F, 1.0F, 1.0F, 1.0F};
  };
  struct Block {
    std::uint32_t index;
    IVec3 place;
  };

  Status read_chunk(std::string_view type, ByteReader chunk);
  Status read_block(ByteReader& chunk);
  void read_material(ByteReader& chunk);
  Status read_layer(ByteReader& chunk);
  Status put_block(const Block& block, const Material& material);
  Status put_shape(const Dict& dict, const Material& material, std::size_t at);
  Rgba8 tinted(const std::uint8_t* rgba, const Material& material) const;
  static Dict read_dict(ByteReader& chunk);

  std::span<const std::byte> bytes_;
  std::uint32_t version_ = 0;
  std::vector<std::vector<std::uint8_t>> blocks_;
  std::vector<Material> materials_;
  std::map<std::string, std::size_t, std::less<>> left_out_;
  ModelBuilder builder_;
};

Result<LoadedScene> GoxelReader::read() {
  ByteReader reader(bytes_);
  static_cast<void>(reader.take(4));
  version_ = reader.u32();
  if (version_ < 1 || version_ > 2) {
    return make_error(ErrorCode::Unsupported, "Goxel version " + std::to_string(version_) + " is not supported", {}, 4);
  }
  while (reader.remaining() > 0) {
    const std::size_t at = reader.position();
    const std::string_view type = reader.text(4);
    const std::size_t size = reader.u32();
    const std::size_t begin = reader.position();
    static_cast<void>(reader.take(size));
    static_cast<void>(reader.u32());  // the checksum; programs compute it differently
    if (reader.failed()) return bad_at(at, "a chunk extends past the end of the file");
    if (auto done = read_chunk(type, ByteReader(bytes_, begin, begin + size)); !done) return done.error();
  }
  for (const auto& [what, count] : left_out_) builder_.warn("left out: " + std::to_string(count) + " " + what);
  return builder_.take("goxel");
}

Status GoxelReader::read_chunk(std::string_view type, ByteReader chunk) {
  if (type == "BL16") return read_block(chunk);
  if (type == "LAYR") return read_layer(chunk);
  if (type == "MATE") {
    read_material(chunk);
    return {};
  }
  if (type == "CAMR") ++left_out_["cameras"];
  if (type == "IMG ") ++left_out_["image settings"];
  if (type == "LIGH") ++left_out_["light settings"];
  const bool is_known = type == "CAMR" || type == "LIGH" || type == "IMG " || type == "PREV";
  if (!is_known) ++left_out_["unknown chunks"];
  return {};
}

Status GoxelReader::read_block(ByteReader& chunk) {
  const std::size_t at = chunk.position();
  const auto png = chunk.take(chunk.remaining());
  // An image starts with its size; images that are not a block are not decoded.
  constexpr std::size_t kSizesAt = 16;
  ByteReader sizes(png);
  static_cast<void>(sizes.take(kSizesAt));
  const std::array<std::uint8_t, 8> edge_64 = {0, 0, 0, 64, 0, 0, 0, 64};
  if (!std::ranges::equal(sizes.take(edge_64.size()), std::as_bytes(std::span(edge_64)))) {
    return bad_at(at, "a block is not an image of 64 x 64 pixels");
  }
  auto image = decode_png(png);
  if (!image) return bad_at(at, "a block is not an image: " + image.error().message);
  if (image->pixels.size() != kBlockBytes) return bad_at(at, "a block does not have 16^3 voxels");
  blocks_.push_back(std::move(image->pixels));
  return {};
}

// Names and values, until an empty name.
GoxelReader::Dict GoxelReader::read_dict(ByteReader& chunk) {
  Dict dict;
  for (;;) {
    const std::size_t length = chunk.remaining() == 0 ? 0 : chunk.u32();
    if (length == 0) return dict;
    const std::string key(chunk.text(length));
    const auto value = chunk.take(chunk.u32());
    if (chunk.failed()) return dict;
    dict[key] = value;
  }
}

template <std::size_t Count>
void read_numbers(std::span<const std::byte> bytes, std::array<float, Count>& numbers) {
  ByteReader reader(bytes);
  for (float& number : numbers) {
    const float read = reader.f32();
    if (!reader.failed() && std::isfinite(read)) number = read;
  }
}

void GoxelReader::read_material(ByteReader& chunk) {
  const Dict dict = read_dict(chunk);
  Material material;
  const auto value = [&](std::string_view name) {
    const auto found = dict.find(name);
    return found == dict.end() ? std::span<const std::byte>() : found->second;
  };
  material.properties.name = text_of(value("name"));
  read_numbers(value("color"), material.colour);
  std::array<float, 1> metallic{0.0F};
  std::array<float, 1> roughness{1.0F};
  std::array<float, 3> emission{};
  read_numbers(value("metallic"), metallic);
  read_numbers(value("roughness"), roughness);
  read_numbers(value("emission"), emission);
  material.properties.metalness = std::clamp(metallic[0], 0.0F, 1.0F);
  material.properties.roughness = std::clamp(roughness[0], 0.0F, 1.0F);
  material.properties.emission = std::clamp(std::max({emission[0], emission[1], emission[2]}), 0.0F, 1000.0F);
  material.number = builder_.add_material(material.properties);
  materials_.push_back(std::move(material));
}

Status GoxelReader::read_layer(ByteReader& chunk) {
  const std::size_t at = chunk.position();
  const std::size_t count = chunk.count(20);
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < count; ++i) {
    Block block{chunk.u32(), {}};
    for (int axis = 0; axis < 3; ++axis) block.place[axis] = chunk.i32();
    static_cast<void>(chunk.u32());
    const auto is_far = [&](int axis) {
      return block.place[axis] < -kMaxGoxelPlace || block.place[axis] > kMaxGoxelPlace;
    };
    if (is_far(0) || is_far(1) || is_far(2)) return bad_at(at, "a block position is out of range");
    if (block.index >= blocks_.size()) return bad_at(at, "a layer refers to a block that does not exist");
    if (version_ == 1) block.place -= kBlockEdge / 2;
    blocks.push_back(block);
  }
  if (chunk.failed()) return bad_at(at, "a layer ends too early");
  const Dict dict = read_dict(chunk);
  const auto value = [&](std::string_view name) {
    const auto found = dict.find(name);
    return ByteReader(found == dict.end() ? std::span<const std::byte>() : found->second);
  };
  Model model;
  if (const auto name = dict.find("name"); name != dict.end()) model.name = text_of(name->second);
  ByteReader visible = value("visible");
  model.visible = visible.remaining() == 0 || visible.u8() != 0;
  const bool is_shape = count == 0 && dict.contains("shape");
  if (count == 0 && !is_shape && value("base_id").u32() != 0) ++left_out_["cloned layers"];
  const std::int32_t index = value("material").i32();
  const bool has_material =
      dict.contains("material") && index >= 0 && static_cast<std::size_t>(index) < materials_.size();
  const Material material = has_material ? materials_[static_cast<std::size_t>(index)] : Material{};
  builder_.begin(std::move(model));
  builder_.use_material(material.number);
  if (is_shape) return put_shape(dict, material, at);
  for (const Block& block : blocks) {
    if (auto put = put_block(block, material); !put) return put;
  }
  return {};
}

enum class Shape : std::uint8_t { Sphere, Cube, Cylinder };

std::optional<Shape> shape_named(std::string_view name) {
  if (name == "sphere") return Shape::Sphere;
  if (name == "cube") return Shape::Cube;
  if (name == "cylinder") return Shape::Cylinder;
  return std::nullopt;
}

/// Returns true for points of a shape that fills the box from -1 to 1.
bool is_inside(Shape shape, const DVec3& p) {
  if (shape == Shape::Sphere) return glm::dot(p, p) <= 1.0;
  if (shape == Shape::Cylinder) return p.x * p.x + p.y * p.y <= 1.0 && std::abs(p.z) <= 1.0;
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= 1.0;
}

/// Reads a column-major matrix; missing numbers are the identity's.
glm::dmat4 matrix_of(std::span<const std::byte> bytes) {
  std::array<float, 16> numbers{};
  for (std::size_t i = 0; i < 4; ++i) numbers[5 * i] = 1.0F;
  read_numbers(bytes, numbers);
  glm::dmat4 matrix(1.0);
  for (std::size_t i = 0; i < 16; ++i) matrix[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = double{numbers[i]};
  return matrix;
}

/// Returns the voxels that the box from -1 to 1 may cover under a matrix.
DBox box_of_shape(const glm::dmat4& placed) {
  DVec3 reach(0.0);
  for (int axis = 0; axis < 3; ++axis) reach += glm::abs(DVec3(placed[axis]));
  const DVec3 middle(placed[3]);
  return {glm::floor(middle - reach), glm::ceil(middle + reach)};
}

Rgba8 GoxelReader::tinted(const std::uint8_t* rgba, const Material& material) const {
  const auto times = [&](std::uint8_t channel, std::size_t i) {
    return static_cast<std::uint8_t>(std::lround(channel * std::clamp(material.colour.at(i), 0.0F, 1.0F)));
  };
  return {times(rgba[0], 0), times(rgba[1], 1), times(rgba[2], 2), std::max<std::uint8_t>(times(255, 3), 1)};
}

// A voxel is set if its centre is inside.
Status GoxelReader::put_shape(const Dict& dict, const Material& material, std::size_t at) {
  const std::string_view name = text_of(dict.find("shape")->second);
  const auto shape = shape_named(name);
  const auto mat = dict.find("mat");
  const glm::dmat4 placed = matrix_of(mat != dict.end() ? mat->second : std::span<const std::byte>());
  if (!shape || glm::determinant(glm::dmat3(placed)) == 0.0) {
    ++left_out_[shape ? "shapes without a volume" : "unknown shapes"];
    return {};
  }
  std::array<std::uint8_t, 4> rgba{255, 255, 255, 255};
  if (const auto colour = dict.find("color"); colour != dict.end() && colour->second.size() >= rgba.size()) {
    std::memcpy(rgba.data(), colour->second.data(), rgba.size());
  }
  constexpr double kMostVoxels = 1 << 27;
  const DBox box = box_of_shape(placed);
  const DVec3 size = box.max - box.min;
  const double farthest = std::max(glm::length(box.min), glm::length(box.max));
  if (!(size.x * size.y * size.z <= kMostVoxels) || !(farthest < kMaxGoxelPlace)) {
    return make_error(ErrorCode::LimitExceeded, "a shape has more than 2^27 voxels or is out of range", {}, at);
  }
  const glm::dmat4 shape_from_voxel = glm::inverse(placed);
  const Rgba8 colour = tinted(rgba.data(), material);
  const IVec3 first(box.min);
  const IVec3 end(box.max);
  for (int z = first.z; z < end.z; ++z) {
    for (int y = first.y; y < end.y; ++y) {
      int run = 0;
      for (int x = first.x; x <= end.x; ++x) {
        const DVec3 centre = DVec3(x, y, z) + 0.5;
        const bool is_set = x < end.x && is_inside(*shape, DVec3(shape_from_voxel * glm::dvec4(centre, 1.0)));
        if (is_set) ++run;
        if (is_set || run == 0) continue;
        if (auto put = builder_.put({x - run, z, -y - 1}, colour, run, 0); !put) return put;
        run = 0;
      }
    }
  }
  return {};
}

Status GoxelReader::put_block(const Block& block, const Material& material) {
  constexpr std::uint8_t kSolid = 127;
  QUOIN_ASSERT(block.index < blocks_.size(), "a block of the file");
  const std::vector<std::uint8_t>& pixels = blocks_[block.index];
  for (int i = 0; i < kBlockEdge * kBlockEdge * kBlockEdge; ++i) {
    const std::uint8_t* const rgba = pixels.data() + std::size_t{4} * static_cast<std::size_t>(i);
    if (rgba[3] < kSolid) continue;
    const IVec3 at = block.place + IVec3(i % 16, i / 16 % 16, i / 256);
    if (auto put = builder_.put({at.x, at.z, -at.y - 1}, tinted(rgba, material)); !put) return put;
  }
  return {};
}

bool is_goxel(std::span<const std::byte> beginning) {
  return ByteReader(beginning).text(4) == kMagic;
}

constexpr FormatHolds kGoxelHolds = {
    .extension = ".gox", .names = true, .hidden = true, .several = true, .transparency = true, .materials = true};
constexpr std::uint32_t kGoxelVersion = 2;

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
    out_.u32(kGoxelVersion);
  }

  Result<EncodedFile> run(const Progress& progress);

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
  QUOIN_ASSERT(begin >= 4 && begin <= out_.size(), "a chunk that was begun");
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
  QUOIN_ASSERT(pixels.size() == kBlockBytes, "the voxels of a block");
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
          QUOIN_ASSERT(type < material_of_.size(), "a type of the scene");
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
  QUOIN_ASSERT(layer.first < std::max<std::size_t>(materials_.size(), 1), "a material of the file");
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

Result<EncodedFile> GoxelWriter::run(const Progress& progress) {
  auto placed = place_grids(scene_, kGoxelHolds);
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
  return EncodedFile{out_.take(), std::move(placed->warnings)};
}

/// Writes version 2: a layer for each instance, and for each material of it.
Result<EncodedFile> write_goxel(const FormatOutput& output) {
  return GoxelWriter(output.scene).run(output.progress);
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kGoxelFormat = {
    .info = {FileFormat::Goxel, ".gox", "Goxel", FormatCapability::Read | FormatCapability::Write},
    .detect = models::is_goxel,
    .read = [](const FormatInput& input) { return models::GoxelReader(input.bytes).read(); },
    .encode = models::write_goxel,
};

}  // namespace quoin
