#include <quoin/grid/texture.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <mutex>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/grid/voxel_registry.h>

#include "core/memory/make_room.h"
#include "core/rows/packed_row.h"
#include "core/srgb.h"

namespace quoin {

Vec3 linear_colour(Rgba8 colour) {
  const std::array<float, 256>& linear = linear_bytes();
  return {linear[colour.r], linear[colour.g], linear[colour.b]};
}

Rgba8 srgb_colour(Vec3 light) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  return {encode(light.x), encode(light.y), encode(light.z), 255};
}

struct Texture::Content {
  std::string name;
  int size = 0;
  bool is_opaque = true;
  Vec3 mean{0.0F};
  float mean_alpha = 1.0F;
  float coverage = 1.0F;
  std::uint64_t hash = 0;
  std::array<std::size_t, 12> level_begin{};  // [level], and the end
  bool is_measured = false;                   // the members above are set
  BlockVector<Rgba8> texels;                  // of all levels, level 0 first
  std::atomic<const Rgba8*> ready = nullptr;  // `texels`, once they are complete
  mutable std::mutex mutex;                   // guards `decode` and its result
  std::function<AlphaImage()> decode;         // of a deferred texture without texels

  void fill(const AlphaImage& image, bool keeps_texels);
  [[nodiscard]] AlphaImage decoded() const;
  [[nodiscard]] const Rgba8* all_texels() const;
};

namespace {

static_assert(sizeof(Rgba8) == 4 && kMaxTextureSize == 1 << 10);

/// A texel of a mipmap before it is rounded: linear light and alpha, 0 to 1.
struct Light {
  Vec3 colour{0.0F};
  float alpha = 1.0F;
};

Light mean_of(const Light& a, const Light& b, const Light& c, const Light& d) {
  const float alpha = a.alpha + b.alpha + c.alpha + d.alpha;
  if (!(alpha > 0.0F)) return {(a.colour + b.colour + c.colour + d.colour) * 0.25F, 0.0F};
  const Vec3 sum = a.colour * a.alpha + b.colour * b.alpha + c.colour * c.alpha + d.colour * d.alpha;
  return {sum / alpha, alpha * 0.25F};
}

/// Replaces a square of `size` texels per side with the next level.
void halve(BlockVector<Light>& texels, std::size_t size) {
  QUOIN_ASSERT(size > 1 && texels.size() == size * size, "a square of texels");
  const std::size_t half = size / 2;
  for (std::size_t y = 0; y < half; ++y) {
    for (std::size_t x = 0; x < half; ++x) {
      const Light* const at = texels.data() + 2 * y * size + 2 * x;
      const Light mean = mean_of(at[0], at[1], at[size], at[size + 1]);
      texels[y * half + x] = mean;  // the place was read before, since it lies in an earlier or equal place
    }
  }
  texels.resize(half * half);
}

// Returns the number of texels of all levels: side^2 * (1 + 1/4 + 1/16 + ...).
std::size_t texel_count(std::size_t side) {
  return (4 * side * side - 1) / 3;
}

std::uint8_t byte_of(float unit) {
  return static_cast<std::uint8_t>(std::lround(unit * 255.0F));
}

// Returns a hash of the name and level 0. The other levels follow from it.
std::uint64_t hash_of(const std::string& name, const std::vector<std::uint8_t>& rgba) {
  std::uint64_t hash = rgba.size();
  for (const char c : name) hash = mixed_with(hash, static_cast<unsigned char>(c));
  for (std::size_t i = 0; i + 8 <= rgba.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, &rgba[i], sizeof(word));
    hash = mixed_with(hash, word);
  }
  return hash;
}

std::string fault_of(const AlphaImage& image) {
  const std::string sizes = std::to_string(image.width) + " x " + std::to_string(image.height) + " texels";
  const bool is_power = image.width > 0 && std::has_single_bit(static_cast<unsigned>(image.width));
  if (image.width != image.height || !is_power || image.width < kMinTextureSize || image.width > kMaxTextureSize) {
    return "its sides must be equal, and 16, 32, 64, 128, 256, 512 or 1024 texels long, not " + sizes;
  }
  const auto side = static_cast<std::size_t>(image.width);
  return image.rgba.size() == 4 * side * side ? "" : "it must have 4 bytes for each of its " + sizes;
}

}  // namespace

void Texture::Content::fill(const AlphaImage& image, bool keeps_texels) {
  const auto side = static_cast<std::size_t>(image.width);
  if (keeps_texels) {
    texels.resize(texel_count(side));
    std::memcpy(texels.data(), image.rgba.data(), image.rgba.size());
  }
  BlockVector<Light> level(side * side);
  std::size_t visible = 0;
  bool all_opaque = true;
  const std::array<float, 256>& linear = linear_bytes();
  for (std::size_t i = 0; i < level.size(); ++i) {
    const std::uint8_t* const texel = &image.rgba[4 * i];
    level[i] = {{linear[texel[0]], linear[texel[1]], linear[texel[2]]}, static_cast<float>(texel[3]) / 255.0F};
    all_opaque &= texel[3] == 255;
    visible += texel[3] >= kCutoutAlpha ? 1 : 0;
  }
  std::size_t end = level.size();
  std::size_t number = 1;
  std::array<std::size_t, 12> begins{};
  begins[number] = end;
  for (std::size_t edge = side; edge > 1; edge /= 2) {
    halve(level, edge);
    for (std::size_t i = 0; keeps_texels && i < level.size(); ++i) {
      Rgba8& out = texels[end + i];
      out = srgb_colour(level[i].colour);
      out.a = byte_of(level[i].alpha);
    }
    end += level.size();
    begins[++number] = end;
  }
  QUOIN_ASSERT(end == texel_count(side) && level.size() == 1, "all levels are full");
  if (is_measured) return;  // other threads may read the rest
  is_measured = true;
  level_begin = begins;
  is_opaque = all_opaque;
  coverage = static_cast<float>(visible) / static_cast<float>(side * side);
  mean = level.front().colour;
  mean_alpha = level.front().alpha;
  hash = hash_of(name, image.rgba);
}

AlphaImage Texture::Content::decoded() const {
  AlphaImage image = decode();
  QUOIN_ASSERT(image.width == size && fault_of(image).empty(), "the image that was decoded before");
  return image;
}

const Rgba8* Texture::Content::all_texels() const {
  if (const Rgba8* const made = ready.load(std::memory_order_acquire)) [[likely]]
    return made;
  auto& self = const_cast<Content&>(*this);  // NOLINT: texels are a cache
  const std::scoped_lock lock(self.mutex);
  if (const Rgba8* const made = ready.load(std::memory_order_acquire)) return made;
  self.fill(decoded(), true);
  self.decode = nullptr;
  self.ready.store(texels.data(), std::memory_order_release);
  return texels.data();
}

Result<Texture> Texture::from_image(std::string name, const AlphaImage& image) {
  return made(std::move(name), image, nullptr);
}

Result<Texture> Texture::deferred(std::string name, const AlphaImage& image, std::function<AlphaImage()> decode) {
  QUOIN_ASSERT(decode != nullptr, "a function that returns the image");
  return made(std::move(name), image, std::move(decode));
}

Result<Texture> Texture::made(std::string name, const AlphaImage& image, std::function<AlphaImage()> decode) {
  if (const std::string fault = fault_of(image); !fault.empty()) {
    return make_error(ErrorCode::InvalidArgument, "cannot use texture \"" + name + "\": " + fault);
  }
  const auto content = std::make_shared<Content>();
  content->name = std::move(name);
  content->size = image.width;
  content->fill(image, decode == nullptr);
  if (decode == nullptr) content->ready.store(content->texels.data(), std::memory_order_release);
  content->decode = std::move(decode);
  return Texture(content);
}

const std::string& Texture::name() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->name;
}

int Texture::size() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->size;
}

int Texture::level_count() const {
  return std::bit_width(static_cast<unsigned>(size()));
}

std::span<const Rgba8> Texture::level(int level) const {
  QUOIN_ASSERT(level >= 0 && level < level_count(), "a level of the texture");
  const std::size_t* const begin = content_->level_begin.data() + level;
  return {content_->all_texels() + begin[0], begin[1] - begin[0]};
}

AlphaImage Texture::image() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  if (!has_texels()) {
    const std::scoped_lock lock(content_->mutex);
    if (!has_texels()) return content_->decoded();
  }
  const std::span<const Rgba8> texels = level(0);
  AlphaImage made{size(), size(), std::vector<std::uint8_t>(texels.size() * sizeof(Rgba8))};
  std::memcpy(made.rgba.data(), texels.data(), made.rgba.size());
  return made;
}

bool Texture::is_opaque() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->is_opaque;
}

Vec3 Texture::mean() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->mean;
}

float Texture::mean_alpha() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->mean_alpha;
}

float Texture::coverage() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->coverage;
}

std::uint64_t Texture::hash() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->hash;
}

std::size_t Texture::bytes() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return texel_count(static_cast<std::size_t>(content_->size)) * sizeof(Rgba8);
}

bool Texture::has_texels() const {
  QUOIN_ASSERT(content_ != nullptr, "a texture that is not null");
  return content_->ready.load(std::memory_order_acquire) != nullptr;
}

bool Texture::operator==(const Texture& other) const {
  if (content_ == other.content_) return true;
  if (content_ == nullptr || other.content_ == nullptr || content_->hash != other.content_->hash) return false;
  if (content_->name != other.content_->name || content_->size != other.content_->size) return false;
  // Level 0 decides, as the other levels follow from it. A comparison does not make a deferred texture keep its texels.
  if (!has_texels() || !other.has_texels()) return image().rgba == other.image().rgba;
  return std::ranges::equal(level(0), other.level(0));
}

VoxelFaces::VoxelFaces(const VoxelFace& all) : VoxelFaces(std::array{all, all, all, all, all, all}) {}

VoxelFaces::VoxelFaces(const VoxelFace& sides, const VoxelFace& top, const VoxelFace& bottom)
    : VoxelFaces(std::array{sides, sides, top, bottom, sides, sides}) {}

VoxelFaces::VoxelFaces(const std::array<VoxelFace, 6>& by_direction)
    : faces_(std::make_shared<const std::array<VoxelFace, 6>>(by_direction)) {}

Rgba8 VoxelFaces::mean_colour() const {
  Vec3 sum(0.0F);
  Vec3 plain(0.0F);
  float alpha = 0.0F;
  for (const Direction direction : kDirections) {
    const VoxelFace& face = (*this)[direction];
    const Texture& texture = face.texture;
    const float share = face.alpha == FaceAlpha::Cutout ? texture.coverage() : texture.mean_alpha();
    const Vec3 colour = texture.mean() * linear_colour(face.tint);
    plain += colour;
    sum += colour * share;
    alpha += share;
  }
  Rgba8 mean = srgb_colour(alpha > 0.0F ? sum / alpha : plain / 6.0F);
  mean.a = byte_of(alpha / 6.0F);
  return mean;
}

TextureFrame texture_frame(const VoxelFace& face, Direction direction) {
  QUOIN_ASSERT(face.turn < 4 && static_cast<std::size_t>(direction) < 6, "a turn of 0 to 3, and a direction");
  using Axes = std::array<std::array<int, 3>, 6>;
  constexpr Axes kRight = {{{0, 0, -1}, {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, {1, 0, 0}, {-1, 0, 0}}};
  constexpr Axes kDown = {{{0, -1, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 0, -1}, {0, -1, 0}, {0, -1, 0}}};
  const auto axis_of = [&](const Axes& axes) {
    const std::array<int, 3>& axis = axes[static_cast<std::size_t>(direction)];
    return IVec3(axis[0], axis[1], axis[2]);
  };
  TextureFrame frame{axis_of(kRight), axis_of(kDown)};
  // A clockwise turn moves the texture's right to where its bottom was.
  for (int i = 0; i < face.turn; ++i) frame = {frame.down, -frame.right};
  if (face.mirrored) frame.right = -frame.right;
  return frame;
}

VoxelFace turned_face(const VoxelFaces& faces, Direction direction, const AxisOrientation& orientation) {
  const Direction unturned = orientation.inverse().apply(direction);
  VoxelFace face = faces[unturned];
  const TextureFrame frame = texture_frame(face, unturned);
  const TextureFrame wanted{orientation.apply(frame.right), orientation.apply(frame.down)};
  // The eight turns and mirrors have all pairs of axes along the face.
  for (int i = 0; i < 8; ++i) {
    face.turn = static_cast<std::uint8_t>(i % 4);
    face.mirrored = i >= 4;
    if (texture_frame(face, direction) == wanted) break;
  }
  return face;
}

std::array<float, 4> texel_at(const VoxelFace& face, Direction direction, const DVec3& inside, int level) {
  const TextureFrame frame = texture_frame(face, direction);
  const int number = std::clamp(level, 0, face.texture.level_count() - 1);
  const auto size = static_cast<std::uint32_t>(face.texture.size()) >> number;
  const auto along = [&](const IVec3& axis) {
    const int i = axis.x != 0 ? 0 : axis.y != 0 ? 1 : 2;
    return texel_number(std::clamp(inside[i], -1.0, 2.0), axis[i], size);
  };
  const Rgba8 texel = face.texture.level(number)[along(frame.down) * size + along(frame.right)];
  const Vec3 colour = linear_colour(texel) * linear_colour(face.tint);
  return {colour.x, colour.y, colour.z, static_cast<float>(texel.a) / 255.0F};
}

TextureSet::TextureSet(std::size_t max_layers) : max_layers_(max_layers) {
  QUOIN_ASSERT(max_layers > 0, "at least one layer per array");
}

TextureLayer TextureSet::add(const Texture& texture) {
  if (const auto known = find(texture)) return *known;
  // Allocates first, so that a failure leaves the set as it was. A size without an array counts as none.
  std::optional<std::uint32_t>& open = open_[texture.size()];
  if (open && arrays_[*open].layers.size() < max_layers_) {
    std::vector<Texture>& layers = arrays_[*open].layers;
    make_room(layers);
    const TextureLayer added{*open, static_cast<std::uint32_t>(layers.size())};
    by_hash_.emplace(texture.hash(), added);
    layers.push_back(texture);
    return added;
  }
  make_room(arrays_);
  Array array{texture.size(), {texture}};
  const TextureLayer added{static_cast<std::uint32_t>(arrays_.size()), 0};
  by_hash_.emplace(texture.hash(), added);
  arrays_.push_back(std::move(array));
  open = added.array;
  return added;
}

void TextureSet::add(const VoxelRegistry& types) {
  if (!types.has_textures() && !types.has_shapes()) return;
  for (std::size_t type = 1; type < types.size(); ++type) {
    const VoxelProperties& properties = types[static_cast<VoxelType>(type)];
    for_each_look(properties, [&](const VoxelFace& look) {
      if (!look.texture.is_null()) add(look.texture);
    });
  }
}

std::optional<TextureLayer> TextureSet::find(const Texture& texture) const {
  QUOIN_ASSERT(!texture.is_null(), "a texture that is not null");
  const auto [first, last] = by_hash_.equal_range(texture.hash());
  for (auto it = first; it != last; ++it) {
    if ((*this)[it->second] == texture) return it->second;
  }
  return std::nullopt;
}

const Texture& TextureSet::operator[](TextureLayer layer) const {
  QUOIN_ASSERT(layer.array < arrays_.size() && layer.layer < arrays_[layer.array].layers.size(), "a layer of the set");
  return arrays_[layer.array].layers[layer.layer];
}

std::size_t TextureSet::bytes() const {
  std::size_t total = 0;
  for (const Array& array : arrays_) {
    for (const Texture& texture : array.layers) total += texture.bytes();
  }
  return total;
}

}  // namespace quoin
