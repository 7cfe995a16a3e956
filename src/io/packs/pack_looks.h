#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/block_packs.h>

#include "io/minecraft/block_looks.h"
#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/families.h"
#include "io/packs/pack_files.h"
#include "io/packs/pack_textures.h"

// The looks of block types by resource packs.

namespace quoin::packs {

/// The block states of one pack, and models. These can come from more packs: models of a mod inherit from those of the
/// game.
struct PackLibrary {
  PackLibrary(const PackFiles& states_of, const PackFiles& models_of) : pack(states_of), models(models_of) {}

  const PackFiles& pack;
  ModelReader models;
  std::map<std::string, Result<std::shared_ptr<const BlockStates>>> states{};  // by block; null: the pack has none

  /// Returns the block states of a block; null if the pack does not have them. Errors: those of parse_block_states and
  /// read_pack_json, with the file.
  [[nodiscard]] Result<std::shared_ptr<const BlockStates>> states_of(const std::string& block);
};

/// Gives types their looks. Threads: any number may call all functions at once.
class BlockLooks {
 public:
  /// `own`: used for blocks without a model with elements in `packs`, also for textures; null if there is none.
  explicit BlockLooks(std::shared_ptr<const PackFiles> packs, std::shared_ptr<const PackFiles> own = nullptr);

  /// Reads the textures of the types from number `first` on several threads, so that `applied` finds them. Cost: a
  /// search for the models of each type.
  void prepare(const VoxelRegistry& types, std::size_t first, Threads threads);
  /// Returns a type with its look; unchanged if it is neither a Minecraft block nor a Luanti node, or no look is found.
  [[nodiscard]] VoxelProperties applied(const VoxelProperties& type);
  [[nodiscard]] BlockPackReport report() const;

  /// Returns the identity of the packs, as PackFiles::identity.
  [[nodiscard]] std::string identity() const { return all_->identity(); }

 private:
  class Maker;
  /// A colour map of 256 x 256 pixels, read at its first use.
  struct ColourMap {
    bool is_read = false;
    std::optional<AlphaImage> image{};
  };
  struct Source;
  [[nodiscard]] std::vector<Source> sources_of(const VoxelProperties& type);
  [[nodiscard]] std::vector<Source> sources_of_node(const VoxelProperties& type);
  void note(std::string name, const std::string& reason);
  [[nodiscard]] std::optional<std::uint32_t> colour_in(ColourMap& map, const char* name,
                                                       const minecraft::Climate& climate);
  [[nodiscard]] std::uint32_t tint_by_maps(minecraft::Tint tint, std::uint32_t rgb);

  std::shared_ptr<const PackFiles> packs_;
  std::shared_ptr<const PackFiles> own_;
  std::shared_ptr<const PackFiles> nodes_;  // the tables of Luanti nodes; null without a pack that shows nodes
  std::shared_ptr<const PackFiles> all_;    // for models
  std::shared_ptr<const PackFiles> textured_;
  mutable std::mutex mutex_;
  PackLibrary library_;
  std::optional<PackLibrary> own_library_;
  std::optional<PackLibrary> node_library_;
  TextureReader textures_;
  ColourMap grass_;
  ColourMap foliage_;
  std::set<std::string> missing_;  // textures, and models after a blank
  BlockPackReport report_;
};

}  // namespace quoin::packs
