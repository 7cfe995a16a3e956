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

/// The sizes and CRC-32 of a pack's files below `assets`.
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
    const fs::path real = fs::canonical(file, error);
    if (error || std::ranges::mismatch(folder_, real).in1 != folder_.end()) {
      return make_error(ErrorCode::CannotRead, "a link to a file outside the folder of the pack", std::string(path));
    }
    // One byte more shows a file that is too large, also if it grows.
    auto bytes = read_file_beginning(file, max_bytes + 1);
    if (!bytes) return bytes.error();
    if (bytes->size() > max_bytes) return too_large(path, fs::file_size(file, error), max_bytes);
    return FileBytes(std::move(*bytes));
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

// Returns the sums of the files below `assets`, or of the images of a Luanti game, mod or texture pack.
Result<FileSums> sums_of_folder(const fs::path& folder) {
  FileSums sums;
  std::error_code missing;
  const bool has_assets = fs::is_directory(folder / "assets", missing);
  if (!has_assets && !is_node_folder(folder)) return no_assets(folder);
  std::size_t entries = 0;
  std::uint64_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator at(has_assets ? folder / "assets" : folder, error), end; !error && at != end;
       at.increment(error)) {
    if (++entries > kMaxEntries) {
      return make_error(ErrorCode::LimitExceeded,
                        "the folder has more than " + std::to_string(kMaxEntries) + " files and folders",
                        folder.string());
    }
    const std::string path = at->path().lexically_relative(folder).generic_string();
    std::error_code unknown;
    if (!is_pack_path(path)) {
      at.disable_recursion_pending();
    } else if ((has_assets || path.ends_with(".png")) && at->is_regular_file(unknown) &&
               at->file_size(unknown) <= kMaxImageBytes) {
      const auto content = read_file(at->path());
      if (!content) return content.error();
      bytes += content->size();
      if (bytes > kMaxFolderBytes) return too_large(folder.string(), bytes, kMaxFolderBytes);
      sums.emplace(path, ZipParts::Sum{content->size(), crc32_of(*content)});
    }
  }
  if (error) return make_error(ErrorCode::CannotRead, error.message(), folder.string());
  return sums;
}

}  // namespace

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
