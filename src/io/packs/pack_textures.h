#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/grid/texture.h>

#include "io/packs/block_models.h"
#include "io/packs/pack_files.h"

// Textures of resource packs, decoded when a type first uses them.

namespace quoin::packs {

/// A texture with its use of alpha: cutout if nearly all texels are visible or invisible, else translucent.
struct PackTexture {
  Texture texture;
  FaceAlpha alpha = FaceAlpha::Opaque;
};

/// Textures with at least this side keep their PNG instead of their texels until these are read (Texture::deferred), if
/// it has fewer bytes than level 0.
inline constexpr int kDeferredTextureSize = 64;

/// Makes a texture of a PNG: its first frame, if `animation` is the text of its .mcmeta file with an animation. An
/// image is sampled by its nearest pixels unless it is a square with a power of two from 16 to 1,024 as side.
///
/// Errors: BadFormat for images that are no PNG; LimitExceeded above 2^24 pixels, before it is decoded.
[[nodiscard]] Result<PackTexture> texture_of_png(const std::string& name, std::vector<std::byte> png,
                                                 std::string_view animation = {});

/// A rectangle of an image, in pixels.
struct ImageFrame {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// Decodes the texels of a texture again, from the same PNG as texture_of_png. Requires: a frame inside the image.
/// Errors: throws bad_alloc if the PNG cannot be decoded, since it was before.
[[nodiscard]] AlphaImage texels_of_png(std::span<const std::byte> png, const ImageFrame& frame);

/// One texture on a face of an element: the look, and the part that the face shows (ElementFace::part).
struct FaceLayer {
  VoxelFace look;
  std::array<float, 4> part{0.0F, 0.0F, 16.0F, 16.0F};
};

/// Maximum number of texels of blended textures: 256 MiB, without mipmaps.
inline constexpr std::size_t kMaxBlendedTexels = std::size_t{1} << 26;

/// Reads textures by name, each once. Threads: one at a time, except for `read`. Lifetime: the pack.
class TextureReader {
 public:
  explicit TextureReader(const PackFiles& pack, std::size_t max_blended_texels = kMaxBlendedTexels)
      : pack_(pack), max_blended_texels_(max_blended_texels) {}

  /// Returns a texture; null if the pack does not have it. Errors: those of texture_of_png and PackFiles::read, with
  /// the file.
  [[nodiscard]] Result<const PackTexture*> texture(const ResourceName& name);
  /// The result of reading a texture; nullopt if the pack does not have it.
  using Known = Result<std::optional<PackTexture>>;
  [[nodiscard]] bool knows(const ResourceName& name) const { return known_.contains(to_string(name)); }
  /// Reads a texture as `texture` does, without remembering it. Threads: any number at once.
  [[nodiscard]] Known read(const ResourceName& name) const;
  /// Remembers the result of `read`, unless the texture is known.
  void put(const ResourceName& name, Known read) { known_.emplace(to_string(name), std::move(read)); }
  /// Returns a texture of one opaque colour.
  [[nodiscard]] const PackTexture& plain(Rgba8 colour);
  /// Returns the layer that shows both: `upper` with its alpha over `lower`; or only `lower` if it is null. Its tint is
  /// white and its texture shows a whole face, with turn 0. Its share of emission is the mean of both, weighted by their
  /// visible texels. Returns `lower` if all such textures would have more than `max_blended_texels`; see
  /// `refused_blends`.
  [[nodiscard]] FaceLayer blended(const FaceLayer& lower, const FaceLayer* upper);
  /// Returns the number of calls of `blended` that made no texture because of the limit.
  [[nodiscard]] std::size_t refused_blends() const { return refused_blends_; }

 private:
  const PackFiles& pack_;
  std::size_t max_blended_texels_;
  std::map<std::string, Known> known_;
  std::map<std::string, PackTexture> made_;
  struct Blend {
    PackTexture shown;
    float upper_share = 0.0F;  // of the upper layer among the visible texels, 0 to 1
  };
  std::map<std::string, Blend> blends_;
  std::size_t blended_texels_ = 0;
  std::size_t refused_blends_ = 0;
};

}  // namespace quoin::packs
