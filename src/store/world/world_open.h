#pragma once

#include <filesystem>

#include "store/database/connection.h"
#include "store/world/world_reader.h"

namespace quoin::store {

/// Opens a world file for reading, also in a read-only folder.
[[nodiscard]] Result<WorldReader> open_reader(const std::filesystem::path& path, const char* vfs = nullptr);
/// Makes commits of a writing connection durable when they return. Uses a write-ahead log, except on networks.
[[nodiscard]] Status begin_writing(Connection& connection, bool is_network);
/// Empties and disables the log, so that the world is a single file that works on any medium. Returns false if the log
/// is in use: it then stays for the next writer.
bool end_writing(Connection& connection);
/// Removes a database's log files.
void remove_database_log(const std::filesystem::path& path);
/// Removes a database with its log files.
void remove_database(const std::filesystem::path& path);

/// Returns an unused temporary name in the world's folder.
[[nodiscard]] std::filesystem::path fresh_name(const std::filesystem::path& world);

enum class Existing : std::uint8_t { Refused, Replaced };
/// Renames a closed database; after a power cut the new name has the complete file or does not exist. Errors:
/// CannotWrite.
[[nodiscard]] Status move_in_place(const std::filesystem::path& from, const std::filesystem::path& to,
                                   Existing existing = Existing::Refused);

}  // namespace quoin::store
