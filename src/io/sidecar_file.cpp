#include <quoin/io/sidecar_file.h>

#include <algorithm>
#include <string>
#include <system_error>

#include "core/bytes/text.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;

/// Returns true for "C:" and "C:/file", which are absolute on one system and plain names on the others.
bool begins_with_drive(const std::string& name) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return name.size() >= 2 && name[1] == ':' && is_letter(name[0]);
}

/// Returns true if a name without symbolic links stays in its folder.
bool stays_in_folder(const std::string& name) {
  const fs::path path = fs::path(name).lexically_normal();
  return path.is_relative() && !begins_with_drive(name) && path.begin() != path.end() && *path.begin() != "..";
}

/// Returns true if a file lies in a folder or below it once links are followed, and if it does not exist.
bool leads_into_folder(const fs::path& folder, const fs::path& file) {
  std::error_code failed;
  const fs::path whole = fs::canonical(file, failed);
  // Reading fails for the same reasons and reports them.
  if (failed) {
    return failed == std::errc::no_such_file_or_directory || failed == std::errc::not_a_directory ||
           failed == std::errc::permission_denied || failed == std::errc::too_many_symbolic_link_levels;
  }
  const fs::path top = fs::canonical(folder.empty() ? fs::path(".") : folder, failed);
  if (failed) return false;
  return std::mismatch(top.begin(), top.end(), whole.begin(), whole.end()).first == top.end();
}

}  // namespace

Result<fs::path> sidecar_path(const fs::path& from, std::string_view name, SidecarFiles allowed) {
  std::string plain(name);
  std::replace(plain.begin(), plain.end(), '\\', '/');
  if (plain.empty() || plain.find('\0') != std::string::npos) {
    return make_error(ErrorCode::BadFormat, "cannot read a sidecar file: its name is empty");
  }
  const fs::path folder = from.parent_path();
  const fs::path path = folder / plain;
  if (allowed == SidecarFiles::Anywhere) return path;
  if (stays_in_folder(plain) && leads_into_folder(folder, path)) return path;
  return make_error(ErrorCode::CannotRead,
                    "cannot read \"" + printable(std::string(name)) +
                        "\": it is outside the folder of the main file (allow it with --allow-outside-files; in "
                        "programs SidecarFiles::Anywhere)");
}

}  // namespace quoin
