#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/direction.h>
#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

class VoxelRegistry;

/// An sRGB colour with 8 bits per channel. Alpha is linear: 0 is fully transparent, 255 fully opaque.
struct Rgba8 {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  std::uint8_t a = 255;
  bool operator==(const Rgba8&) const = default;
};

/// Converts an sRGB colour to linear light, 0 to 1 per channel, and ignores its alpha. Lamps, environments and vertex
/// colours are in linear light. Cost: three table lookups.
[[nodiscard]] Vec3 linear_colour(Rgba8 colour);
/// Converts linear light to an opaque sRGB colour, each channel rounded to nearest. Values are clamped to [0, 1]; NaN
/// becomes 0.
[[nodiscard]] Rgba8 srgb_colour(Vec3 light);

/// Texels per side of a texture: a power of two in this range.
inline constexpr int kMinTextureSize = 16;
inline constexpr int kMaxTextureSize = 1'024;
/// A texel of a cutout face is visible if its alpha is at least this.
inline constexpr std::uint8_t kCutoutAlpha = 128;

/// A square image for faces of voxels, with its mipmaps. A handle to texels that never change: copies share them. Null
/// by default.
///
/// Texels:   sRGB with linear alpha, not premultiplied. Rows run from the top, texels from the left.
/// Mipmaps:  each level has half the side of the one before, down to one texel. A texel is the mean of the four below
///           it: the colour in linear light and weighted by alpha, so that colours of invisible texels do not show, and
///           the alpha unweighted.
/// Equality: same name and same texels. Cost: one comparison for handles to the same texels, or of different content.
/// Memory:   4/3 * 4 * size^2 bytes, shared by all copies; see `deferred`.
/// Threads:  different copies may be used on several threads at once.
class Texture {
 public:
  Texture() = default;
  /// Makes a texture from an image, for example of a file (io/image_files.h):
  ///
  ///   const auto stone = Texture::from_image("stone", *read_alpha_image("stone.png"));
  ///   types.add({.name = "stone", .faces = *stone});
  ///
  /// Errors: InvalidArgument, naming the texture, if the image is not square, its side is not a power of two from
  ///         kMinTextureSize to kMaxTextureSize, or it has another number of bytes than its sizes require.
  /// Cost:   O(texels), about 50 ns each.
  [[nodiscard]] static Result<Texture> from_image(std::string name, const AlphaImage& image);
  /// Makes a texture that keeps no texels until they are first read, for worlds with more textures than an image shows.
  /// `decode` must return the same image again. Any thread calls it, one at a time: for `image`, and for the first call
  /// to `level`, after which it is released. Errors and cost: as from_image, at both times.
  [[nodiscard]] static Result<Texture> deferred(std::string name, const AlphaImage& image,
                                                std::function<AlphaImage()> decode);

  [[nodiscard]] bool is_null() const { return content_ == nullptr; }

  // All of the following require a texture that is not null.

  [[nodiscard]] const std::string& name() const;
  /// Returns the texels per side of level 0.
  [[nodiscard]] int size() const;
  /// Returns the number of mipmap levels: log2(size) + 1.
  [[nodiscard]] int level_count() const;
  /// Returns the texels of a level, which has size >> level texels per side. The first call for a deferred texture
  /// makes the texels of all levels; errors: bad_alloc. Requires: 0 <= level < level_count().
  [[nodiscard]] std::span<const Rgba8> level(int level) const;
  /// Returns level 0 as an image, for files. Does not keep the texels of a deferred texture.
  [[nodiscard]] AlphaImage image() const;
  /// Returns true if all texels have an alpha of 255.
  [[nodiscard]] bool is_opaque() const;
  /// Returns the mean colour in linear light, weighted by alpha; the unweighted mean if all texels are invisible.
  [[nodiscard]] Vec3 mean() const;
  /// Returns the mean alpha, 0 to 1.
  [[nodiscard]] float mean_alpha() const;
  /// Returns the fraction of texels with an alpha of at least kCutoutAlpha.
  [[nodiscard]] float coverage() const;
  /// Returns a hash of the name and the texels, the same in every process.
  [[nodiscard]] std::uint64_t hash() const;
  /// Returns the memory of the texels of all levels in bytes, also of a deferred texture.
  [[nodiscard]] std::size_t bytes() const;
  /// Returns false if the texture is deferred and its texels have not been read.
  [[nodiscard]] bool has_texels() const;
  /// Returns true if both share their texels, so that they are equal.
  [[nodiscard]] bool shares_texels_with(const Texture& other) const { return content_ == other.content_; }

  /// Returns true if the names and the texels are equal. Does not keep the texels of deferred textures; decodes them if
  /// only the texels may differ.
  bool operator==(const Texture& other) const;

 private:
  struct [[gnu::visibility("hidden")]] Content;
  explicit Texture(std::shared_ptr<const Content> content) : content_(std::move(content)) {}
  [[nodiscard]] static Result<Texture> made(std::string name, const AlphaImage& image,
                                            std::function<AlphaImage()> decode);

  std::shared_ptr<const Content> content_;
};

/// The use of a texture's alpha.
enum class FaceAlpha : std::uint8_t {
  Opaque,       ///< the texture has no transparent texels
  Cutout,       ///< texels are visible or not (kCutoutAlpha): leaves, fences
  Translucent,  ///< alpha blends the face with the background: stained glass
};

/// One face of a voxel: a texture that covers it once.
///
/// Turn 0 shows the texture to a viewer outside as docs/games.md, "Textures", does: on the four sides, its top is at
/// +Y; on +Y its right is at +Z and its top at +X; on -Y its right is at +X and its top at +Z.
struct VoxelFace {
  Texture texture{};
  std::uint8_t turn = 0;      ///< clockwise quarter turns for a viewer outside, 0 to 3
  bool mirrored = false;      ///< exchanges left and right, before the turn
  Rgba8 tint{255, 255, 255};  ///< sRGB; multiplies the texture in linear light; its alpha has no effect
  FaceAlpha alpha = FaceAlpha::Opaque;
  /// Share of the type's emission (VoxelProperties::emission) that the face has, in 255ths: 0 none, 255 all.
  std::uint8_t emission_share = 255;

  bool operator==(const VoxelFace&) const = default;
};

/// Returns VoxelFace::emission_share as a factor, 0 to 1.
[[nodiscard]] inline float emission_factor(const VoxelFace& face) {
  return static_cast<float>(face.emission_share) / 255.0F;
}

/// The six textured faces of a voxel type, or none. Copies share them.
class VoxelFaces {
 public:
  /// Creates no faces: the type has one colour.
  VoxelFaces() = default;
  /// Creates six equal faces.
  VoxelFaces(const Texture& all) : VoxelFaces(VoxelFace{all}) {}
  VoxelFaces(const VoxelFace& all);
  VoxelFaces(const VoxelFace& sides, const VoxelFace& top, const VoxelFace& bottom);
  /// Creates a face for each direction, in the order of kDirections.
  explicit VoxelFaces(const std::array<VoxelFace, 6>& by_direction);

  [[nodiscard]] bool empty() const { return faces_ == nullptr; }
  /// Requires: not empty.
  [[nodiscard]] const VoxelFace& operator[](Direction direction) const {
    QUOIN_ASSERT(faces_ != nullptr && static_cast<std::size_t>(direction) < 6, "a face of a textured type");
    return (*faces_)[static_cast<std::size_t>(direction)];
  }
  /// Returns the mean colour of the six faces: the means of their textures times their tints, in linear light, weighted
  /// by alpha. Alpha is the mean alpha, which for cutout faces is their coverage. Requires: not empty; each face has a
  /// texture.
  [[nodiscard]] Rgba8 mean_colour() const;

  bool operator==(const VoxelFaces& other) const {
    return faces_ == other.faces_ || (faces_ != nullptr && other.faces_ != nullptr && *faces_ == *other.faces_);
  }

 private:
  std::shared_ptr<const std::array<VoxelFace, 6>> faces_;
};

/// The axes of a texture on a face, in the space of the grid: unit vectors along the texture's rows and down its
/// columns. A voxel is one texture wide.
struct TextureFrame {
  IVec3 right{0};
  IVec3 down{0};
  bool operator==(const TextureFrame&) const = default;
};

/// Returns the axes of a face's texture. Requires: `turn` is 0 to 3.
[[nodiscard]] TextureFrame texture_frame(const VoxelFace& face, Direction direction);

/// Returns the face that a type shows in a direction when its faces are turned (VoxelProperties::orientations): with
/// the turn and mirror that the texture has there. Requires: `faces` is not empty; turns are 0 to 3.
[[nodiscard]] VoxelFace turned_face(const VoxelFaces& faces, Direction direction, const AxisOrientation& orientation);

/// Returns the texture coordinates of a point of a face, from the upper left corner of the texture, rightwards and
/// downwards. They change by 1 per voxel and may be negative, so that a texture that repeats covers each voxel of a
/// merged quad once. For a quad's corners, pass positions relative to its voxel, because small numbers are exact in
/// float:
///
///   const auto uv = texture_coordinates(frame, Vec3(quad.corner(i) - quad.voxel()));
[[nodiscard]] inline std::array<float, 2> texture_coordinates(const TextureFrame& frame, const Vec3& position) {
  const auto along = [&](const IVec3& axis) {
    return position.x * static_cast<float>(axis.x) + position.y * static_cast<float>(axis.y) +
           position.z * static_cast<float>(axis.z);
  };
  return {along(frame.right), along(frame.down)};
}

/// Returns the column or row of the nearest texel to a point of a face, clamped to the texture. `share`: the point's
/// position in its voxel along an axis of the grid, 0 to 1, or up to 1 voxel outside. `sign`: 1 or -1, the direction
/// along this axis in which the texture's columns or rows are numbered (TextureFrame). `size`: texels per side of the
/// mipmap level. NaN gives 0.
[[nodiscard]] inline std::uint32_t texel_number(double share, double sign, std::uint32_t size) {
  const double at = (sign * share + (0.5 - 0.5 * sign)) * static_cast<double>(size);
  return std::min(static_cast<std::uint32_t>(std::max(0.0, at)), size - 1U);
}

/// Returns the nearest texel to a point of a face, tinted, in linear light, with its alpha (0 to 1) as the fourth
/// number. `inside`: the position in its voxel, 0 to 1 on each axis; positions outside give texels at the texture's
/// edges. `level`: of the mipmaps, clamped to the texture's.
/// Requires: the face has a texture.
[[nodiscard]] std::array<float, 4> texel_at(const VoxelFace& face, Direction direction, const DVec3& inside, int level);

/// The position of a texture in a TextureSet.
struct TextureLayer {
  std::uint32_t array = 0;  ///< index into TextureSet::arrays
  std::uint32_t layer = 0;
  bool operator==(const TextureLayer&) const = default;
};

/// Numbers textures for devices and files: as layers of arrays, each with textures of one size. Equal textures share a
/// layer. Shares the texels of its textures, and has no copy.
class TextureSet {
 public:
  struct Array {
    int size = 0;  ///< texels per side
    std::vector<Texture> layers;
  };

  /// `max_layers`: the limit of the device per array, at least 1. A full array is followed by another of the same size.
  explicit TextureSet(std::size_t max_layers = 2'048);

  /// Adds a texture and returns its layer, or returns the layer of an equal one. Layers never move. Errors: bad_alloc;
  /// the set is then unchanged. Cost: O(log layers). Requires: not null.
  TextureLayer add(const Texture& texture);
  /// Adds the textures of all types, in the order of the types: of their faces, in the order of kDirections, then of
  /// their shapes, in the order of parts and elements. Cost: O(types and elements).
  void add(const VoxelRegistry& types);

  /// Returns the layer of an equal texture, or nullopt.
  [[nodiscard]] std::optional<TextureLayer> find(const Texture& texture) const;
  [[nodiscard]] const std::vector<Array>& arrays() const { return arrays_; }
  /// Returns the texture of a layer. Requires: the set has this layer.
  [[nodiscard]] const Texture& operator[](TextureLayer layer) const;
  /// Returns the memory of all texels in bytes.
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t max_layers_;
  std::vector<Array> arrays_;
  std::map<int, std::optional<std::uint32_t>> open_;  // by size: the array with room
  std::multimap<std::uint64_t, TextureLayer> by_hash_;
};

}  // namespace quoin
