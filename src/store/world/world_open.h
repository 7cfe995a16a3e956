#pragma once

#include <filesystem>

#include "store/database/connection.h"
#include "store/world/world_reader.h"

namespace quoin::store {

/// A reader of the world in a file; also of one in a folder that may not be written.
[[nodiscard]] Result<WorldReader> open_reader(const std::filesystem::path& path, const char* vfs = nullptr);
/// Has commits of a connection that writes last once they return: from here on by a write-ahead log, but on networks.
[[nodiscard]] Status begin_writing(Connection& connection, bool is_network);
/// Empties the log and does without it, so that nothing lies beside the file and any medium will do for it. False where
/// it is in use: it stays then, and whoever writes next goes on with it.
bool end_writing(Connection& connection);
/// What lies beside a database.
void remove_database_log(const std::filesystem::path& path);
/// A database, and what lies beside it.
void remove_database(const std::filesystem::path& path);

/// A name beside a world for one that is being made, which nobody else uses.
[[nodiscard]] std::filesystem::path fresh_name(const std::filesystem::path& world);

enum class Existing : std::uint8_t { Refused, Replaced };
/// Gives a closed database another name, at which it is whole after any power cut, or is not. Errors: CannotWrite.
[[nodiscard]] Status move_in_place(const std::filesystem::path& from, const std::filesystem::path& to,
                                   Existing existing = Existing::Refused);

}  // namespace quoin::store
