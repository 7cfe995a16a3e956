#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/ref.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace quoin {

/// Names a kind of voxel; an index into a VoxelRegistry. 0 is air in every registry.
using VoxelType = std::uint16_t;
inline constexpr VoxelType kAir = 0;
/// Types besides air that a registry can hold.
inline constexpr std::size_t kMaxVoxelTypes = 65'535;

/// Bits of a voxel's state word (VoxelData).
inline constexpr std::uint8_t kMaxStateBits = 32;

/// How a voxel takes part in visibility, occlusion and light.
enum class Visibility : std::uint8_t { Air, Opaque, Transparent };

/// 8 bits a channel, encoded as sRGB; alpha is linear coverage.
struct Rgba8 {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  std::uint8_t a = 255;
  bool operator==(const Rgba8&) const = default;
};

/// The light that a colour stands for, 0 to 1 a channel, without its alpha: what lamps, looks and vertices are made of.
[[nodiscard]] Vec3 linear_colour(Rgba8 colour);
/// The opaque colour of that light, each channel to the nearest; what is beyond 0 to 1 is cut, NaN is 0.
[[nodiscard]] Rgba8 srgb_colour(Vec3 light);

/// What there is to know of one kind of voxel.
struct VoxelProperties {
  std::string name{};
  Rgba8 colour{};  ///< sRGB; alpha below 255 only matters for transparent types
  Visibility visibility = Visibility::Opaque;
  bool collides = true;    ///< stops a moving body
  float roughness = 1.0F;  ///< glTF's perceptual roughness, 0 to 1
  float metalness = 0.0F;  ///< 0 to 1
  float emission = 0.0F;   ///< radiance emitted, as a multiple of `colour` in linear light; 0 is none
  float ior = 1.5F;        ///< index of refraction, of use to transparent types
  /// Of clouds and the like, which are transparent: how often light is scattered on a voxel's length, on average, in
  /// pictures by paths; `colour` is the albedo, the share of it that goes on. 0: glass.
  float scattering = 0.0F;
  float anisotropy = 0.0F;  ///< of that: the mean cosine of the angle by which light is scattered, -1 to 1
  /// What a file format says beyond the above ("_spec" -> "0.3"), kept so that writing it back loses nothing.
  std::map<std::string, std::string> attributes{};
  /// How many bits of a state word (VoxelData) voxels of this type may have, from the lowest up; 0: they have no state.
  /// `Grid::set_data` does not know the types and takes any; saving (`save_scene`, WorldStore::save) refuses a scene in
  /// which a state has more.
  std::uint8_t state_bits = 0;

  bool operator==(const VoxelProperties&) const = default;
};

/// A type that was added, or replaced by one that may differ in other properties alone.
struct TypeChange {
  VoxelType type = kAir;
  bool visibility_changed = false;  ///< what is not registered counts as opaque
  bool colour_changed = false;      ///< always where the type was added
};
using TypeChanges = Changes<TypeChange>;

/// Whether the visibility of any type changed, or may have: then more than chunks has to be meshed and traced anew.
[[nodiscard]] bool has_other_visibility(const TypeChanges& changes);

/// The kinds of voxels of a scene. Whatever asks "does this block sight or light?" asks here.
///
/// Copies share what they hold until one of them is changed, as a Grid's snapshots do; a cursor that read one reads on
/// in the other until then. Threads: as Grid. Cost: `visibility` is one array look-up.
/// Moving: a registry that was moved from may only be assigned to or destroyed.
class VoxelRegistry {
 public:
  /// Holds air only.
  VoxelRegistry();
  VoxelRegistry(const VoxelRegistry& other);
  VoxelRegistry(VoxelRegistry&&) noexcept;
  VoxelRegistry& operator=(const VoxelRegistry& other);
  VoxelRegistry& operator=(VoxelRegistry&&) noexcept;
  ~VoxelRegistry();

  /// Adds a type and returns its id: ids count up from 1.
  ///
  /// Errors: LimitExceeded beyond kMaxVoxelTypes; InvalidArgument when `visibility` is Air or `state_bits` beyond 32.
  [[nodiscard]] Result<VoxelType> add(VoxelProperties properties);

  /// The id of a type that equals `properties` in everything, or a new one. Errors: as `add`. Cost: O(log types).
  [[nodiscard]] Result<VoxelType> find_or_add(const VoxelProperties& properties);

  /// The type of that name; of several the one with the lowest id. Cost: O(types).
  [[nodiscard]] std::optional<VoxelType> find(std::string_view name) const;

  /// Replaces the properties of `type`. Meshes and pictures made before know nothing of it; `changes_since` tells.
  ///
  /// Requires: type is not air and is registered; visibility is not Air; at most 32 state bits.
  void replace(VoxelType type, VoxelProperties properties);

  /// Lifetime: until a type is added or replaced. Requires: `type < size()`.
  [[nodiscard]] const VoxelProperties& operator[](VoxelType type) const {
    QUOIN_ASSERT(type < size(), "a registered type");
    return content_->properties[type];
  }

  /// Number of ids in use, air included; every id below it is valid.
  [[nodiscard]] std::size_t size() const {
    QUOIN_ASSERT(content_ != nullptr, "a registry that was not moved from");
    return content_->properties.size();
  }

  /// An unregistered id counts as opaque, so that a wrong id shows instead of vanishing.
  [[nodiscard]] Visibility visibility(VoxelType type) const {
    const std::vector<Visibility>& all = content_->visibility;
    return type < all.size() ? all[type] : Visibility::Opaque;
  }
  [[nodiscard]] bool is_opaque(VoxelType type) const { return visibility(type) == Visibility::Opaque; }
  [[nodiscard]] bool is_transparent(VoxelType type) const { return visibility(type) == Visibility::Transparent; }
  /// Whether any registered type is transparent.
  [[nodiscard]] bool has_transparent() const { return content_->transparent_count > 0; }
  /// Whether any registered type besides air stops no moving body (VoxelProperties::collides).
  [[nodiscard]] bool has_passable() const { return content_->passable_count > 0; }

  /// The types that were added or replaced since the cursor's last time, in the order of their ids; moves the cursor to
  /// the present. Cost: O(types that changed). See ChangeCursor.
  [[nodiscard]] TypeChanges changes_since(ChangeCursor& cursor) const;
  /// Whether that would tell of anything. Cost: O(1).
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  /// A cursor at the present: it will be told what changes from now on.
  [[nodiscard]] ChangeCursor cursor() const;

 private:
  struct Content : RefCounted {
    std::vector<VoxelProperties> properties;
    std::vector<Visibility> visibility;
    std::vector<std::uint64_t> serials;  // of the types' last records in the journal
    std::multimap<std::uint64_t, VoxelType> by_hash;
    std::size_t transparent_count = 0;
    std::size_t passable_count = 0;
  };
  struct Journal;
  void note(TypeChange change);

  Ref<Content> content_;
  std::unique_ptr<Journal> journal_;
};

}  // namespace quoin
