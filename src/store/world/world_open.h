#pragma once

#include <filesystem>

#include "store/world/connection.h"
#include "store/world/world_reader.h"

namespace quoin::store {

/// A reader of the world in a file; also of one in a folder that may not be written.
[[nodiscard]] Result<WorldReader> open_reader(const std::filesystem::path& path, const char* vfs = nullptr);
/// Has commits of a connection that writes last once they return: from here on by a write-ahead log, but on networks.
[[nodiscard]] Status begin_writing(Connection& connection, bool is_network);
/// Empties the log and does without it, so that nothing lies beside the file and any medium will do for it. False where
/// it is in use: it stays then, and whoever writes next goes on with it.
bool end_writing(Connection& connection);
/// A database, and what lies beside it.
void remove_database(const std::filesystem::path& path);

}  // namespace quoin::store
