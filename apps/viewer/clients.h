#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace quoin::viewer {

/// An installed client of Minecraft (Java Edition), whose .jar is a resource pack. Nothing of it is run.
struct InstalledClient {
  std::string version;        ///< such as "1.21.4" or "24w14a"
  std::filesystem::path jar;  ///< absolute
};

/// The folders in which launchers keep clients.
struct ClientFolders {
  /// Folders of the official launcher: versions/NAME/NAME.jar.
  /// Source: the Minecraft Wiki, "Client.jar" (https://minecraft.wiki/w/Client.jar).
  std::vector<std::filesystem::path> games;
  /// Folders of Prism Launcher, PolyMC and MultiMC, which keep a client as a library named by its Maven coordinates:
  /// libraries/com/mojang/minecraft/VERSION/minecraft-VERSION-client.jar.
  /// Source: https://prismlauncher.org/wiki/getting-started/data-location/ and the launchers' metadata
  /// (https://github.com/PrismLauncher/meta).
  std::vector<std::filesystem::path> launchers;
};

/// Returns the usual folders of this system, by the environment variables HOME, XDG_DATA_HOME and APPDATA, if they are
/// absolute. They need not exist.
[[nodiscard]] ClientFolders usual_client_folders();

/// Returns true if the first version is newer: releases by their numbers, above snapshots ("24w14a") by week, above
/// other names. A version with an addition ("1.21-pre1") is below the one without.
[[nodiscard]] bool is_newer_version(std::string_view a, std::string_view b);

/// Lists the clients in the folders, the newest version first; of a version that is there several times, the first one.
/// Reads only names and sizes. Leaves out empty files, which launchers of mods make. At most 1,000 clients of the first
/// 10,000 entries of a folder are listed.
[[nodiscard]] std::vector<InstalledClient> find_clients(const ClientFolders& folders);

}  // namespace quoin::viewer
