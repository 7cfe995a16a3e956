#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

#include "io/packs/families.h"
#include "io/packs/pack_files.h"

// Quoin's own block pack: block states, models and textures for every block name, without any file. It is the lowest
// pack of a stack, so files of other packs replace its files.

namespace quoin::packs {

/// Splits "assets/SPACE/FOLDER/NAME.END" into SPACE and NAME; nullopt for other paths. `folder`: with '/' at its end.
[[nodiscard]] std::optional<ResourceName> pack_file_name(std::string_view path, std::string_view folder,
                                                         std::string_view end);

/// Recipes of textures: layers of patterns (pack_patterns.h), each in the colour of a block or in a fixed colour.
/// docs/formats/block_pack.md describes the table. Immutable after it was made.
class TextureRecipes {
 public:
  /// Parses the table. Errors: BadFormat, naming the row, for invalid JSON, unknown patterns and invalid colours.
  [[nodiscard]] static Result<TextureRecipes> from_text(std::string_view table);

  /// Draws a texture of 16x16 texels; nullopt if no recipe has its name. Textures of other names that begin with
  /// "quoin:block/" always exist: their patterns follow from the words of the name.
  [[nodiscard]] std::optional<AlphaImage> draw(const ResourceName& texture) const;

 private:
  struct Layer {
    std::string pattern;
    std::string colour;       ///< "#RRGGBB", or a block name with "{1}" and the like
    float brightness = 1.0F;  ///< multiplies the colour, in linear light
    float alpha = 1.0F;
  };

  std::vector<std::vector<Layer>> rows_;
  NamePatterns names_;
  NamePatterns names_in_folders_;  // with '/'
};

/// The files of the own pack. They are made when they are read: the same bytes every time.
class OwnPack final : public PackFiles {
 public:
  OwnPack(BlockFamilies families, TextureRecipes recipes)
      : families_(std::move(families)), recipes_(std::move(recipes)) {}

  /// Returns the pack of the library's tables, which are parsed at the first call.
  [[nodiscard]] static const std::shared_ptr<const OwnPack>& instance();

  [[nodiscard]] const BlockFamilies& families() const { return families_; }
  /// Reads "assets/SPACE/blockstates/NAME.json", "assets/SPACE/models/block/NAME.json" or
  /// "assets/SPACE/textures/block/NAME.png". Every name has block states, but only blocks and names of the tables have
  /// models and textures. Errors: LimitExceeded if the file is larger than `max_bytes`.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                   std::size_t max_bytes) const override;
  [[nodiscard]] std::string identity() const override { return "builtin"; }
  /// Returns a zip file with the block states of these blocks, their models and textures, and pack.mcmeta. The bytes
  /// are the same every time. Errors: as write_builtin_pack.
  [[nodiscard]] Result<std::vector<std::byte>> zip(std::span<const std::string> blocks) const;

 private:
  BlockFamilies families_;
  TextureRecipes recipes_;
};

}  // namespace quoin::packs
