#include "io/packs/pack_textures.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <new>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/io/image_files.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"

namespace quoin::packs {

namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 24;
constexpr std::size_t kMaxAnimationBytes = std::size_t{1} << 20;
// Alpha of nearly invisible and nearly opaque texels, which editors write by accident.
constexpr int kNearlyClear = 5;
constexpr int kNearlyOpaque = 250;

struct PngSize {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// Returns the size in a PNG's header; nullopt if the file is no PNG.
std::optional<PngSize> size_of_png(std::span<const std::byte> png) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1A\n";
  if (png.size() < 24 || !text_of(png).starts_with(kSignature)) return std::nullopt;
  return PngSize{load<std::uint32_t>(&png[16], std::endian::big), load<std::uint32_t>(&png[20], std::endian::big)};
}

int whole_number(const Json& object, const char* key, int otherwise) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_integer()) return otherwise;
  const auto number = found->get<std::int64_t>();
  return number >= 0 && number <= 1 << 16 ? static_cast<int>(number) : otherwise;
}

/// Returns the first frame of an image.
ImageFrame first_frame(const AlphaImage& image, std::string_view animation) {
  const ImageFrame whole{0, 0, image.width, image.height};
  if (json_extent(animation, JsonComments::Allowed).depth > 16) return whole;
  const Json json = Json::parse(animation, nullptr, false, true);
  const auto found = json.is_object() ? json.find("animation") : json.end();
  if (!json.is_object() || found == json.end() || !found->is_object()) return whole;
  const int edge = std::min(image.width, image.height);
  const bool has_size = found->contains("width") || found->contains("height");
  ImageFrame frame = whole;
  frame.width = std::clamp(whole_number(*found, "width", has_size ? image.width : edge), 1, image.width);
  frame.height = std::clamp(whole_number(*found, "height", has_size ? image.height : edge), 1, image.height);
  int index = 0;
  if (const auto frames = found->find("frames"); frames != found->end() && frames->is_array() && !frames->empty()) {
    const Json& first = frames->front();
    if (first.is_object()) index = whole_number(first, "index", 0);
    if (first.is_number_integer())
      index = static_cast<int>(std::clamp<std::int64_t>(first.get<std::int64_t>(), 0, 65'536));
  }
  const int columns = image.width / frame.width;
  const int count = columns * (image.height / frame.height);
  if (index >= count) index = 0;
  frame.x = index % columns * frame.width;
  frame.y = index / columns * frame.height;
  return frame;
}

/// Returns the pixel of `length` in the middle of texel `i` of `size`.
int middle_of(int i, int size, int length) {
  return static_cast<int>((2 * std::int64_t{i} + 1) * length / (2 * std::int64_t{size}));
}

/// Returns a square image of a frame, with sides that textures can have.
AlphaImage squared(AlphaImage image, const ImageFrame& frame) {
  const auto longest = static_cast<unsigned>(std::max(frame.width, frame.height));
  const int size = std::clamp(static_cast<int>(std::bit_ceil(longest)), kMinTextureSize, kMaxTextureSize);
  if (frame.width == size && frame.height == size && image.width == size && image.height == size) return image;
  AlphaImage made{size, size, {}};
  made.rgba.resize(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) * 4);
  std::size_t to = 0;
  for (int y = 0; y < size; ++y) {
    const int row = frame.y + middle_of(y, size, frame.height);
    for (int x = 0; x < size; ++x) {
      const int column = frame.x + middle_of(x, size, frame.width);
      const std::size_t from = 4 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                                    static_cast<std::size_t>(column));
      for (std::size_t i = 0; i < 4; ++i) made.rgba[to++] = image.rgba[from + i];
    }
  }
  return made;
}

/// Makes alpha exact where it nearly is, and returns its use.
FaceAlpha settle_alpha(AlphaImage& image) {
  std::size_t clear = 0;
  std::size_t between = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    std::uint8_t& alpha = image.rgba[i];
    if (alpha <= kNearlyClear) {
      alpha = 0;
      ++clear;
    } else if (alpha >= kNearlyOpaque) {
      alpha = 255;
    } else {
      ++between;
    }
  }
  if (clear + between == 0) return FaceAlpha::Opaque;
  // Smoothed edges of leaves are few texels.
  return between * 20 > image.rgba.size() / 4 ? FaceAlpha::Translucent : FaceAlpha::Cutout;
}

Result<PackTexture> texture_of(const std::string& name, AlphaImage image) {
  PackTexture made;
  made.alpha = settle_alpha(image);
  auto texture = Texture::from_image(name, image);
  if (!texture) return texture.error();
  made.texture = std::move(*texture);
  return made;
}

/// Returns a texel of a layer at a point of the face, from 0 at the upper left corner to 1: tinted, and alpha.
std::array<float, 4> texel_of(const FaceLayer& layer, float right, float down) {
  for (int i = 0; i < layer.look.turn; ++i) {
    const float before = right;
    right = down;
    down = 1.0F - before;
  }
  if (layer.look.mirrored) right = 1.0F - right;
  const auto [u0, v0, u1, v1] = layer.part;
  const int size = layer.look.texture.size();
  const auto texel = [&](float at) {
    return static_cast<std::size_t>(
        std::clamp(static_cast<int>(std::floor(at / 16.0F * static_cast<float>(size))), 0, size - 1));
  };
  const std::size_t row = texel(v0 + (v1 - v0) * down);
  const std::size_t column = texel(u0 + (u1 - u0) * right);
  const Rgba8 colour = layer.look.texture.level(0)[row * static_cast<std::size_t>(size) + column];
  const Vec3 light = linear_colour(colour) * linear_colour(layer.look.tint);
  return {light.x, light.y, light.z, static_cast<float>(colour.a) / 255.0F};
}

std::string text_of_layer(const FaceLayer& layer) {
  const Rgba8 tint = layer.look.tint;
  std::string text = layer.look.texture.name() + "#" + std::to_string(tint.r << 16 | tint.g << 8 | tint.b);
  text += "/" + std::to_string(layer.look.turn) + (layer.look.mirrored ? "m" : "");
  for (const float at : layer.part) text += "," + to_text(at);
  return text;
}

}  // namespace

Result<PackTexture> texture_of_png(const std::string& name, std::vector<std::byte> png, std::string_view animation) {
  const auto size = size_of_png(png);
  if (!size) return make_error(ErrorCode::BadFormat, "not a PNG image");
  if (std::uint64_t{size->width} * size->height > kMaxPixels) {
    return make_error(ErrorCode::LimitExceeded, "an image of " + std::to_string(size->width) + " x " +
                                                    std::to_string(size->height) + " pixels: at most 2^24 are read");
  }
  auto image = read_alpha_image(png);
  if (!image) return image.error();
  const ImageFrame frame = first_frame(*image, animation);
  AlphaImage square = squared(std::move(*image), frame);
  if (square.width < kDeferredTextureSize || png.size() >= square.rgba.size()) {
    return texture_of(name, std::move(square));
  }
  PackTexture made;
  made.alpha = settle_alpha(square);
  auto decode = [kept = std::make_shared<const std::vector<std::byte>>(std::move(png)), frame] {
    return texels_of_png(*kept, frame);
  };
  auto texture = Texture::deferred(name, square, std::move(decode));
  if (!texture) return texture.error();
  made.texture = std::move(*texture);
  return made;
}

AlphaImage texels_of_png(std::span<const std::byte> png, const ImageFrame& frame) {
  auto image = read_alpha_image(png);
  // libpng reports an allocation that failed as any other error.
  if (!image) throw std::bad_alloc();
  AlphaImage texels = squared(std::move(*image), frame);
  settle_alpha(texels);
  return texels;
}

TextureReader::Known TextureReader::read(const ResourceName& name) const {
  const std::string path = "assets/" + name.space + "/textures/" + name.path + ".png";
  const auto named = [&](Error error) {
    if (error.path.empty()) error.path = path;
    return error;
  };
  auto png = pack_.read(path, kMaxImageBytes);
  if (!png) return named(png.error());
  if (!*png) return std::optional<PackTexture>();
  const auto text = pack_.read(path + ".mcmeta", kMaxAnimationBytes);
  const std::string animation(text && *text ? text_of(**text) : std::string_view());
  auto made = texture_of_png(to_string(name), std::move(**png), animation);
  if (!made) return named(made.error());
  return std::optional(std::move(*made));
}

Result<const PackTexture*> TextureReader::texture(const ResourceName& name) {
  const std::string key = to_string(name);
  auto known = known_.find(key);
  if (known == known_.end()) known = known_.emplace(key, read(name)).first;
  if (!known->second) return known->second.error();
  return known->second->has_value() ? &**known->second : nullptr;
}

const PackTexture& TextureReader::plain(Rgba8 colour) {
  const std::string name = "plain:" + std::to_string(colour.r << 16 | colour.g << 8 | colour.b);
  if (const auto known = made_.find(name); known != made_.end()) return known->second;
  AlphaImage image{kMinTextureSize, kMinTextureSize, {}};
  for (int i = 0; i < kMinTextureSize * kMinTextureSize; ++i) {
    for (const std::uint8_t byte : {colour.r, colour.g, colour.b, std::uint8_t{255}}) image.rgba.push_back(byte);
  }
  auto made = texture_of(name, std::move(image));
  QUOIN_ASSERT(made, "a square image of 16 pixels per side");
  return made_.emplace(name, std::move(*made)).first->second;
}

FaceLayer TextureReader::blended(const FaceLayer& lower, const FaceLayer* upper) {
  const std::string name = text_of_layer(lower) + (upper == nullptr ? "" : "+" + text_of_layer(*upper));
  FaceLayer result;
  const auto use = [&](const Blend& made) {
    const float from = lower.look.emission_share;
    const float to = upper == nullptr ? from : upper->look.emission_share;
    const auto share = static_cast<std::uint8_t>(std::lround(from + (to - from) * made.upper_share));
    result.look = {.texture = made.shown.texture, .alpha = made.shown.alpha, .emission_share = share};
    return result;
  };
  if (const auto known = blends_.find(name); known != blends_.end()) return use(known->second);
  const auto [left, top, right_end, bottom] = lower.part;
  const float extent = std::max(std::abs(right_end - left), std::abs(bottom - top)) / 16.0F;
  const auto texels = static_cast<unsigned>(std::lround(extent * static_cast<float>(lower.look.texture.size())));
  int size = std::clamp(static_cast<int>(std::bit_ceil(std::max(texels, 1U))), kMinTextureSize, kMaxTextureSize);
  if (upper != nullptr) size = std::max(lower.look.texture.size(), upper->look.texture.size());
  const std::size_t texels_of_all = blended_texels_ + static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  if (texels_of_all > max_blended_texels_) {
    ++refused_blends_;
    return lower;
  }
  blended_texels_ = texels_of_all;
  AlphaImage image{size, size, {}};
  double visible = 0.0;
  double upper_visible = 0.0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float right = (static_cast<float>(x) + 0.5F) / static_cast<float>(size);
      const float down = (static_cast<float>(y) + 0.5F) / static_cast<float>(size);
      const auto below = texel_of(lower, right, down);
      const auto above = upper == nullptr ? std::array<float, 4>{} : texel_of(*upper, right, down);
      const float alpha = above[3] + below[3] * (1.0F - above[3]);
      const float share = alpha > 0.0F ? above[3] / alpha : 0.0F;
      visible += alpha;
      upper_visible += above[3];
      const Rgba8 colour =
          srgb_colour({above[0] * share + below[0] * (1.0F - share), above[1] * share + below[1] * (1.0F - share),
                       above[2] * share + below[2] * (1.0F - share)});
      const auto byte = static_cast<std::uint8_t>(std::lround(alpha * 255.0F));
      for (const std::uint8_t each : {colour.r, colour.g, colour.b, byte}) image.rgba.push_back(each);
    }
  }
  auto made = texture_of(name, std::move(image));
  QUOIN_ASSERT(made, "a square image of the size of a texture");
  const auto share = static_cast<float>(visible > 0.0 ? upper_visible / visible : 0.0);
  return use(blends_.emplace(name, Blend{std::move(*made), share}).first->second);
}

}  // namespace quoin::packs
