#include "clients.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <optional>
#include <set>
#include <system_error>
#include <tuple>

namespace quoin::viewer {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxClients = 1'000;
constexpr std::size_t kMaxEntries = 10'000;

/// Returns the folder in a variable, with `below` appended; nullopt if it is not an absolute path.
std::optional<fs::path> folder_of(const char* variable, const char* below = "") {
  const char* const value = std::getenv(variable);
  const fs::path path = value == nullptr ? "" : value;
  return path.is_absolute() ? std::optional(path / below) : std::nullopt;
}

/// The order of versions.
struct VersionKey {
  int kind = 0;  // 2: release, 1: snapshot, 0: another name
  std::vector<int> numbers;
  bool is_whole = true;  // no addition
  std::string rest;
};

/// Reads a whole number at the beginning of `text` and removes it.
std::optional<int> take_number(std::string_view& text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || text.front() == '-') return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

VersionKey key_of(std::string_view version) {
  VersionKey key;
  std::string_view rest = version;
  const auto first = rest.empty() ? std::nullopt : take_number(rest);
  if (first && rest.starts_with('w')) {
    rest.remove_prefix(1);
    if (const auto week = rest.empty() ? std::nullopt : take_number(rest)) key = {1, {*first, *week}, true, ""};
  } else if (first && rest.starts_with('.')) {
    key = {2, {*first}, true, ""};
    while (rest.size() > 1 && rest.starts_with('.')) {
      std::string_view after = rest.substr(1);
      const auto number = take_number(after);
      if (!number) break;
      key.numbers.push_back(*number);
      rest = after;
    }
    key.is_whole = rest.empty();
  } else {
    rest = version;
  }
  key.rest = rest;
  return key;
}

void add_client(std::string version, const fs::path& jar, std::vector<InstalledClient>& clients) {
  std::error_code failed;
  const bool is_file = fs::is_regular_file(jar, failed) && fs::file_size(jar, failed) > 0;
  if (is_file && !failed && clients.size() < kMaxClients) clients.push_back({std::move(version), jar});
}

/// Calls `use` with the name of each entry of a folder.
template <class Use>
void for_each_name(const fs::path& folder, Use use) {
  std::error_code failed;
  std::size_t count = 0;
  for (fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, failed), end;
       !failed && at != end && count < kMaxEntries; at.increment(failed), ++count) {
    use(at->path().filename().string());
  }
}

}  // namespace

ClientFolders usual_client_folders() {
  ClientFolders folders;
  const auto add = [](std::vector<fs::path>& list, const std::optional<fs::path>& folder) {
    if (folder && std::ranges::find(list, *folder) == list.end()) list.push_back(*folder);
  };
  add(folders.games, folder_of("HOME", ".minecraft"));
  add(folders.games, folder_of("APPDATA", ".minecraft"));
  add(folders.games, folder_of("HOME", "Library/Application Support/minecraft"));
  add(folders.games, folder_of("HOME", ".var/app/com.mojang.Minecraft/.minecraft"));
  for (const std::string name : {"PrismLauncher", "PolyMC", "multimc"}) {
    add(folders.launchers, folder_of("XDG_DATA_HOME", name.c_str()));
    add(folders.launchers, folder_of("HOME", (".local/share/" + name).c_str()));
    add(folders.launchers, folder_of("APPDATA", name.c_str()));
    add(folders.launchers, folder_of("HOME", ("Library/Application Support/" + name).c_str()));
  }
  add(folders.launchers, folder_of("HOME", ".var/app/org.prismlauncher.PrismLauncher/data/PrismLauncher"));
  return folders;
}

bool is_newer_version(std::string_view a, std::string_view b) {
  const VersionKey first = key_of(a);
  const VersionKey second = key_of(b);
  return std::tie(first.kind, first.numbers, first.is_whole, first.rest) >
         std::tie(second.kind, second.numbers, second.is_whole, second.rest);
}

std::vector<InstalledClient> find_clients(const ClientFolders& folders) {
  std::vector<InstalledClient> found;
  for (const fs::path& game : folders.games) {
    for_each_name(game / "versions", [&](const std::string& name) {
      add_client(name, game / "versions" / name / (name + ".jar"), found);
    });
  }
  for (const fs::path& launcher : folders.launchers) {
    const fs::path libraries = launcher / "libraries/com/mojang/minecraft";
    for_each_name(libraries, [&](const std::string& name) {
      add_client(name, libraries / name / ("minecraft-" + name + "-client.jar"), found);
    });
  }
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return is_newer_version(a.version, b.version); });
  std::set<std::string> seen;
  std::erase_if(found, [&](const InstalledClient& client) { return !seen.insert(client.version).second; });
  return found;
}

}  // namespace quoin::viewer
