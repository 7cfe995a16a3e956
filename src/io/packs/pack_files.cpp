#include "io/packs/pack_files.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <ranges>
#include <system_error>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/bytes.h"
#include "core/bytes/files.h"
#include "core/bytes/text.h"
#include "core/rows/packed_row.h"
#include "io/packs/node_pack.h"
#include "io/zip.h"

namespace quoin::packs {

namespace {

namespace fs = std::filesystem;
using FileBytes = std::optional<std::vector<std::byte>>;

constexpr std::uint64_t kMaxZipBytes = std::uint64_t{2} << 30;
// Limits of a folder whose content is hashed.
constexpr std::size_t kMaxEntries = std::size_t{1} << 20;
constexpr std::uint64_t kMaxFolderBytes = kMaxZipBytes;

/// The sizes and CRC-32 of a pack's files.
using FileSums = std::map<std::string, ZipParts::Sum>;

std::uint64_t with_text(std::uint64_t hash, std::string_view text) {
  hash = mixed_with(hash, text.size());
  for (const char c : text) hash = mixed_with(hash, static_cast<unsigned char>(c));
  return hash;
}

std::uint64_t hash_of(const FileSums& sums) {
  std::uint64_t hash = kHashSeed;
  for (const auto& [name, sum] : sums) hash = mixed_with(mixed_with(with_text(hash, name), sum.size), sum.crc);
  return hash;
}

Error too_large(std::string_view path, std::uint64_t size, std::uint64_t most) {
  return make_error(ErrorCode::LimitExceeded, printable(path) + " has " + std::to_string(size) + " bytes: at most " +
                                                  std::to_string(most) + " are read");
}

/// Returns the path of a texture of a block in packs before 1.13, or since; empty for other files.
std::string name_in_other_versions(std::string_view path) {
  constexpr std::array<std::string_view, 2> kFolders = {"/textures/block/", "/textures/blocks/"};
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t at = path.find(kFolders[i]);
    if (at == std::string_view::npos) continue;
    return std::string(path.substr(0, at)).append(kFolders[1 - i]).append(path.substr(at + kFolders[i].size()));
  }
  return {};
}

class FolderPack final : public PackFiles {
 public:
  /// Requires: an absolute path without links.
  explicit FolderPack(fs::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] Result<FileBytes> read(std::string_view path, std::size_t max_bytes) const override {
    if (!is_pack_path(path)) return FileBytes();
    const fs::path file = folder_ / fs::path(path);
    std::error_code error;
    if (!fs::is_regular_file(file, error)) return FileBytes();
    if (const auto inside = check_inside(folder_, file); !inside) return inside.error();
    // One byte more shows a file that is too large, also if it grows.
    auto bytes = read_file_beginning(file, max_bytes + 1);
    if (!bytes) return bytes.error();
    if (bytes->size() > max_bytes) return too_large(path, fs::file_size(file, error), max_bytes);
    return FileBytes(std::move(*bytes));
  }

  [[nodiscard]] bool has(std::string_view path) const override {
    std::error_code error;
    return is_pack_path(path) && fs::is_regular_file(folder_ / fs::path(path), error);
  }

  [[nodiscard]] std::string identity() const override { return "folder " + folder_.string(); }

 private:
  fs::path folder_;
};

class ZipPack final : public PackFiles {
 public:
  static Result<std::shared_ptr<const ZipPack>> open(std::vector<std::byte> bytes) {
    if (!text_of(bytes).starts_with("PK")) {
      return make_error(ErrorCode::BadFormat, "not a resource pack: neither a folder nor a zip file", {}, 0);
    }
    const std::shared_ptr<ZipPack> pack(new ZipPack(std::move(bytes)));
    auto parts = ZipParts::open(pack->bytes_);
    if (!parts) return parts.error();
    pack->parts_ = std::move(*parts);
    const auto prefix = prefix_of(pack->parts_.names());
    if (!prefix) {
      return make_error(ErrorCode::InvalidArgument, "not a resource pack: the zip file has no folder assets");
    }
    pack->prefix_ = *prefix;
    return std::shared_ptr<const ZipPack>(pack);
  }

  [[nodiscard]] FileSums sums() const {
    FileSums sums;
    for (const std::string& name : parts_.names()) {
      if (!name.starts_with(prefix_)) continue;
      const std::string path = name.substr(prefix_.size());
      const ZipParts::Sum sum = parts_.sum_of(name);
      if (path.starts_with("assets/") && is_pack_path(path) && sum.size <= kMaxImageBytes) sums.emplace(path, sum);
    }
    return sums;
  }

  [[nodiscard]] Result<FileBytes> read(std::string_view path, std::size_t max_bytes) const override {
    if (!is_pack_path(path)) return FileBytes();
    const std::string name = prefix_ + std::string(path);
    if (!parts_.has(name)) return FileBytes();
    auto bytes = parts_.read(name, max_bytes);
    if (!bytes) return bytes.error();
    return FileBytes(std::move(*bytes));
  }

  [[nodiscard]] bool has(std::string_view path) const override {
    return is_pack_path(path) && parts_.has(prefix_ + std::string(path));
  }

  [[nodiscard]] std::string identity() const override {
    return "zip " + std::to_string(bytes_.size()) + " " + std::to_string(hash_of(sums()));
  }

 private:
  explicit ZipPack(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  /// Returns the folder that holds `assets`: "" or "NAME/"; nullopt if there is none.
  static std::optional<std::string> prefix_of(const std::vector<std::string>& names) {
    std::optional<std::string> found;
    for (const std::string& name : names) {
      if (name.starts_with("assets/")) return "";
      const std::size_t slash = name.find('/');
      if (found || slash == std::string::npos) continue;
      if (std::string_view(name).substr(slash + 1).starts_with("assets/")) found = name.substr(0, slash + 1);
    }
    return found;
  }

  std::vector<std::byte> bytes_;
  ZipParts parts_;
  std::string prefix_;
};

Result<std::shared_ptr<const ZipPack>> open_zip_pack(const fs::path& path) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  if (!error && size > kMaxZipBytes) return too_large(path.string(), size, kMaxZipBytes);
  auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  return with_path(ZipPack::open(std::move(*bytes)), path);
}

Error no_assets(const fs::path& folder) {
  return make_error(ErrorCode::InvalidArgument,
                    "not a resource pack: the folder has no folder assets, and is no Luanti game or mod",
                    folder.string());
}

/// Adds up the files of a folder that FolderPack or NodeFolder read. Requires: an absolute path without links.
class FolderSums {
 public:
  explicit FolderSums(const fs::path& folder) : folder_(folder) {}

  /// Adds the files of a folder and those below, also through links that stay inside.
  Status add_folder(const fs::path& at) {
    std::error_code error;
    const fs::path real = fs::canonical(at, error);
    if (error || !check_inside(folder_, at)) return {};
    if (std::ranges::find(entered_, real) != entered_.end()) {
      return make_error(ErrorCode::CannotRead, "a link to a folder that contains it", at.string());
    }
    entered_.push_back(real);
    fs::directory_iterator entry(at, error);
    for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
      if (++entries_ > kMaxEntries) {
        return make_error(ErrorCode::LimitExceeded,
                          "the folder has more than " + std::to_string(kMaxEntries) + " files and folders",
                          folder_.string());
      }
      const std::string path = entry->path().lexically_relative(folder_).generic_string();
      if (!is_pack_path(path)) continue;
      std::error_code unknown;
      const auto done = entry->is_directory(unknown) ? add_folder(entry->path()) : add_file(path, entry->path());
      if (!done) return done.error();
    }
    if (error) return make_error(ErrorCode::CannotRead, error.message(), at.string());
    entered_.pop_back();
    return {};
  }

  /// Adds a file by a name. Files that are never read do not count: too large, or behind links out of the folder.
  Status add_file(const std::string& name, const fs::path& file) {
    std::error_code unknown;
    if (!fs::is_regular_file(file, unknown) || !check_inside(folder_, file)) return {};
    const std::uint64_t size = fs::file_size(file, unknown);
    if (unknown || size > kMaxImageBytes) return {};
    const auto content = read_file(file);
    if (!content) return content.error();
    bytes_ += content->size();
    if (bytes_ > kMaxFolderBytes) return too_large(folder_.string(), bytes_, kMaxFolderBytes);
    sums_.emplace(name, ZipParts::Sum{content->size(), crc32_of(*content)});
    return {};
  }

  [[nodiscard]] FileSums take() { return std::move(sums_); }

 private:
  const fs::path& folder_;
  std::vector<fs::path> entered_;
  FileSums sums_;
  std::size_t entries_ = 0;
  std::uint64_t bytes_ = 0;
};

/// Returns the sums of the files below `assets`, or of the tiles of a Luanti game, mod or texture pack.
Result<FileSums> sums_of_folder(const fs::path& path) {
  std::error_code error;
  const fs::path folder = fs::canonical(path, error);
  if (error) return make_error(ErrorCode::CannotRead, "cannot find the folder: " + error.message(), path.string());
  FolderSums sums(folder);
  if (fs::is_directory(folder / "assets", error)) {
    if (auto done = sums.add_folder(folder / "assets"); !done) return done.error();
    return sums.take();
  }
  if (!is_node_folder(folder)) return no_assets(path);
  const auto tiles = tiles_of_folder(folder);
  if (!tiles) return tiles.error();
  for (const auto& [name, file] : *tiles) {
    if (auto done = sums.add_file(tile_path(name), file); !done) return done.error();
  }
  return sums.take();
}

}  // namespace

Status check_inside(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path real = fs::canonical(file, error);
  if (!error && std::ranges::mismatch(folder, real).in1 == folder.end()) return {};
  return make_error(ErrorCode::CannotRead, "a link to a file outside the folder of the pack",
                    file.lexically_relative(folder).generic_string());
}

bool PackFiles::has(std::string_view path) const {
  const auto bytes = read(path, kMaxImageBytes);
  return !bytes || *bytes;
}

bool is_pack_path(std::string_view path) {
  constexpr std::size_t kMaxPath = 512;
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-' || c == '/';
  };
  if (path.empty() || path.size() > kMaxPath || !std::ranges::all_of(path, is_plain)) return false;
  for (const auto part : std::views::split(path, '/')) {
    const std::string_view name(part.begin(), part.end());
    if (name.empty() || name == "." || name == "..") return false;
  }
  return true;
}

ResourceName split_resource_name(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return {"minecraft", std::string(text)};
  return {colon == 0 ? "minecraft" : std::string(text.substr(0, colon)), std::string(text.substr(colon + 1))};
}

std::optional<ResourceName> resource_name(std::string_view text) {
  ResourceName name = split_resource_name(text);
  if (!is_pack_path(name.space) || name.space.find('/') != std::string::npos || !is_pack_path(name.path)) {
    return std::nullopt;
  }
  return name;
}

std::string to_string(const ResourceName& name) {
  return name.space + ":" + name.path;
}

Result<std::shared_ptr<const PackFiles>> open_pack(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    if (!fs::is_directory(path / "assets", error)) {
      return is_node_folder(path) ? open_node_folder(path) : no_assets(path);
    }
    const fs::path folder = fs::canonical(path, error);
    if (error) return make_error(ErrorCode::CannotRead, "cannot find the folder: " + error.message(), path.string());
    return std::shared_ptr<const PackFiles>(std::make_shared<FolderPack>(folder));
  }
  auto pack = open_zip_pack(path);
  if (!pack) return pack.error();
  return std::shared_ptr<const PackFiles>(std::move(*pack));
}

Result<std::shared_ptr<const PackFiles>> open_pack(std::vector<std::byte> zip) {
  if (zip.size() > kMaxZipBytes) return too_large("the zip file", zip.size(), kMaxZipBytes);
  auto pack = ZipPack::open(std::move(zip));
  if (!pack) return pack.error();
  return std::shared_ptr<const PackFiles>(std::move(*pack));
}

Result<std::uint64_t> hash_of_files(const fs::path& path) {
  FileSums sums;
  std::error_code error;
  if (fs::is_directory(path, error)) {
    auto found = sums_of_folder(path);
    if (!found) return found.error();
    sums = std::move(*found);
  } else {
    const auto pack = open_zip_pack(path);
    if (!pack) return pack.error();
    sums = (*pack)->sums();
  }
  return hash_of(sums);
}

void MemoryPack::put(std::string_view path, std::string content) {
  QUOIN_ASSERT(is_pack_path(path), "a pack path");
  files_.insert_or_assign(std::string(path), std::move(content));
}

Result<FileBytes> MemoryPack::read(std::string_view path, std::size_t max_bytes) const {
  const auto found = files_.find(path);
  if (found == files_.end() || !is_pack_path(path)) return FileBytes();
  const std::string& content = found->second;
  if (content.size() > max_bytes) return too_large(path, content.size(), max_bytes);
  std::vector<std::byte> bytes(content.size());
  if (!content.empty()) std::memcpy(bytes.data(), content.data(), content.size());
  return FileBytes(std::move(bytes));
}

std::string MemoryPack::identity() const {
  std::uint64_t hash = files_.size();
  for (const auto& [path, content] : files_) {
    hash = with_text(with_text(hash, path), content);
  }
  return "memory " + std::to_string(hash);
}

std::string PackStack::identity() const {
  std::string text;
  for (const auto& pack : packs_) text += (text.empty() ? "" : "; ") + pack->identity();
  return text;
}

Result<std::shared_ptr<const PackStack>> PackStack::open(std::span<const fs::path> paths,
                                                         std::vector<std::vector<std::byte>> zips) {
  std::vector<std::shared_ptr<const PackFiles>> packs;
  for (const fs::path& path : paths) {
    auto pack = open_pack(path);
    if (!pack) return pack.error();
    packs.push_back(std::move(*pack));
  }
  for (std::vector<std::byte>& zip : zips) {
    auto pack = open_pack(std::move(zip));
    if (!pack) return pack.error();
    packs.push_back(std::move(*pack));
  }
  return std::make_shared<const PackStack>(std::move(packs));
}

bool PackStack::has_tiles() const {
  return std::ranges::any_of(packs_, [](const auto& pack) { return pack->has_tiles(); });
}

Result<FileBytes> PackStack::read(std::string_view path, std::size_t max_bytes) const {
  auto bytes = read_exact(path, max_bytes);
  if (!bytes || *bytes) return bytes;
  const std::string other = substitute_of(path);
  return other.empty() ? FileBytes() : read_exact(other, max_bytes);
}

bool PackStack::has(std::string_view path) const {
  if (has_exact(path)) return true;
  const std::string other = substitute_of(path);
  return !other.empty() && has_exact(other);
}

std::string PackStack::substitute_of(std::string_view path) const {
  if (!has_tiles()) return {};
  // A tile that exists has no other tile's animation.
  constexpr std::string_view kAnimationEnd = ".mcmeta";
  const bool is_animation = path.ends_with(kAnimationEnd);
  const std::string_view image = path.substr(0, path.size() - (is_animation ? kAnimationEnd.size() : 0));
  std::string other = tile_without_end(image);
  if (other.empty() || !is_animation) return other;
  return has_exact(image) ? std::string() : other.append(kAnimationEnd);
}

bool PackStack::has_exact(std::string_view path) const {
  const std::string other_name = name_in_other_versions(path);
  return std::ranges::any_of(
      packs_, [&](const auto& pack) { return pack->has(path) || (!other_name.empty() && pack->has(other_name)); });
}

Result<FileBytes> PackStack::read_exact(std::string_view path, std::size_t max_bytes) const {
  const std::string other_name = name_in_other_versions(path);
  for (const auto& pack : std::views::reverse(packs_)) {
    auto bytes = pack->read(path, max_bytes);
    if (!bytes || *bytes) return bytes;
    if (other_name.empty()) continue;
    bytes = pack->read(other_name, max_bytes);
    if (!bytes || *bytes) return bytes;
  }
  return FileBytes();
}

}  // namespace quoin::packs
