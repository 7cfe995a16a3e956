// Goxel files: chunks of a type, a size, content and a checksum. Goxel's z points up; +x, +z, -y are this library's
// axes.
//
//   BL16   16^3 voxels as a PNG of 64 x 64 pixels
//   MATE   a material
//   LAYR   a layer: its blocks with their positions, and its properties; without blocks a shape in the box from -1 to
//          1 (`mat` places it)

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "io/byte_reader.h"
#include "io/image/png.h"
#include "io/models/model_builder.h"
#include "io/models/models.h"

namespace quoin::models {

namespace {

constexpr std::string_view kMagic = "GOX ";
constexpr int kBlockEdge = 16;
constexpr std::size_t kBlockBytes = std::size_t{4} * kBlockEdge * kBlockEdge * kBlockEdge;
constexpr std::int32_t kMaxPlace = 1 << 26;

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
    const auto is_far = [&](int axis) { return block.place[axis] < -kMaxPlace || block.place[axis] > kMaxPlace; };
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
  if (!(size.x * size.y * size.z <= kMostVoxels) || !(farthest < kMaxPlace)) {
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
  const std::vector<std::uint8_t>& pixels = blocks_[block.index];
  for (int i = 0; i < kBlockEdge * kBlockEdge * kBlockEdge; ++i) {
    const std::uint8_t* const rgba = pixels.data() + std::size_t{4} * static_cast<std::size_t>(i);
    if (rgba[3] < kSolid) continue;
    const IVec3 at = block.place + IVec3(i % 16, i / 16 % 16, i / 256);
    if (auto put = builder_.put({at.x, at.z, -at.y - 1}, tinted(rgba, material)); !put) return put;
  }
  return {};
}

}  // namespace

bool is_goxel(std::span<const std::byte> beginning) {
  return ByteReader(beginning).text(4) == kMagic;
}

Result<LoadedScene> read_goxel(std::span<const std::byte> bytes) {
  return GoxelReader(bytes).read();
}

}  // namespace quoin::models
