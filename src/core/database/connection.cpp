#include "core/database/connection.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <system_error>
#include <utility>

#include <sqlite3.h>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

// Time that a read or a commit waits for another process: long enough for any Quoin process, short enough to report.
constexpr int kBusyMilliseconds = 10'000;
// Limit for a row: a chunk, a part or a value. Quoin writes no larger rows.
constexpr int kMaxRowBytes = 256 << 20;

// Returns the system's error text if there is one, otherwise SQLite's.
std::string reason_of(sqlite3* database, int code) {
  const int number = database == nullptr ? 0 : sqlite3_system_errno(database);
  const int kind = code & 0xFF;
  if (number != 0 && (kind == SQLITE_IOERR || kind == SQLITE_CANTOPEN)) return std::generic_category().message(number);
  return sqlite3_errstr(code);
}

Error with_reason(ErrorCode code, const char* what, sqlite3* database, int fault) {
  return make_error(code, std::string(what) + ": " + reason_of(database, fault));
}

bool is_of_reading(int code) {
  return code == SQLITE_IOERR_READ || code == SQLITE_IOERR_SHORT_READ || code == SQLITE_IOERR_FSTAT;
}

// The settings of every connection: a database may be untrusted, so code in it is disabled and corruption is detected.
Status harden(sqlite3* database) {
  const auto set = [&](int option, int value) {
    return sqlite3_db_config(database, option, value, nullptr) == SQLITE_OK;
  };
  const bool is_set = set(SQLITE_DBCONFIG_DEFENSIVE, 1) && set(SQLITE_DBCONFIG_ENABLE_TRIGGER, 0) &&
                      set(SQLITE_DBCONFIG_ENABLE_VIEW, 0) && set(SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0);
  if (!is_set) return make_error(ErrorCode::Unsupported, "this version of SQLite cannot read untrusted files safely");
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, kMaxRowBytes);
  sqlite3_extended_result_codes(database, 1);
  sqlite3_busy_timeout(database, kBusyMilliseconds);
  return {};
}

}  // namespace

Error error_of(sqlite3* database, int code) {
  switch (code & 0xFF) {
    case SQLITE_FULL:
      return make_error(ErrorCode::CannotWrite, "the disk is full");
    case SQLITE_READONLY:
      return make_error(ErrorCode::CannotWrite, "file is read-only");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return make_error(ErrorCode::CannotWrite, "another program has locked it");
    case SQLITE_NOTADB:
      return make_error(ErrorCode::BadFormat, "not an SQLite database");
    case SQLITE_CORRUPT:
      return make_error(ErrorCode::BadFormat, kDamagedDatabase);
    case SQLITE_NOMEM:
      throw std::bad_alloc();
    case SQLITE_TOOBIG:
      return make_error(ErrorCode::LimitExceeded, "a row exceeds 256 MiB");
    case SQLITE_CANTOPEN:
      return with_reason(ErrorCode::CannotRead, "cannot open it", database, code);
    case SQLITE_IOERR:
      if (is_of_reading(code)) return with_reason(ErrorCode::CannotRead, "cannot read it", database, code);
      return with_reason(ErrorCode::CannotWrite, "cannot write it", database, code);
    default:
      break;
  }
  return make_error(ErrorCode::BadFormat, database != nullptr ? sqlite3_errmsg(database) : sqlite3_errstr(code));
}

void Statement::Finalizer::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

void Statement::bind(int parameter, std::int64_t value) {
  [[maybe_unused]] const int code = sqlite3_bind_int64(statement_.get(), parameter + 1, value);
  QUOIN_ASSERT(code == SQLITE_OK, "a parameter of a reset statement");
}

void Statement::bind(int parameter, std::string_view text) {
  const int code =
      sqlite3_bind_text64(statement_.get(), parameter + 1, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  if (code == SQLITE_NOMEM) throw std::bad_alloc();
  QUOIN_ASSERT(code == SQLITE_OK || code == SQLITE_TOOBIG, "a parameter of a reset statement");
}

void Statement::bind(int parameter, std::span<const std::byte> bytes) {
  // A null pointer would be NULL, not an empty blob.
  const void* data = bytes.empty() ? static_cast<const void*>("") : bytes.data();
  [[maybe_unused]] const int code =
      sqlite3_bind_blob64(statement_.get(), parameter + 1, data, bytes.size(), SQLITE_STATIC);
  QUOIN_ASSERT(code == SQLITE_OK || code == SQLITE_TOOBIG, "a parameter of a reset statement");
}

Result<bool> Statement::step() {
  QUOIN_ASSERT(is_prepared(), "a prepared statement");
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  Error error = error_of(sqlite3_db_handle(statement_.get()), code);
  reset();
  return error;
}

Status Statement::run() {
  const auto row = step();
  reset();
  if (!row) return row.error();
  return {};
}

void Statement::reset() {
  if (statement_ != nullptr) sqlite3_reset(statement_.get());
}

std::int64_t Statement::integer(int column) const {
  QUOIN_ASSERT(column >= 0 && column < sqlite3_data_count(statement_.get()), "a column of a row");
  return sqlite3_column_int64(statement_.get(), column);
}

std::span<const std::byte> Statement::bytes(int column) const {
  QUOIN_ASSERT(column >= 0 && column < sqlite3_data_count(statement_.get()), "a column of a row");
  const auto* const data = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  const int count = sqlite3_column_bytes(statement_.get(), column);
  return data == nullptr ? std::span<const std::byte>() : std::span(data, static_cast<std::size_t>(count));
}

std::string_view Statement::text(int column) const {
  const std::span<const std::byte> found = bytes(column);
  return {reinterpret_cast<const char*>(found.data()), found.size()};
}

bool Statement::is_integer(int column) const {
  QUOIN_ASSERT(column >= 0 && column < sqlite3_data_count(statement_.get()), "a column of a row");
  return sqlite3_column_type(statement_.get(), column) == SQLITE_INTEGER;
}

bool Statement::is_bytes(int column) const {
  QUOIN_ASSERT(column >= 0 && column < sqlite3_data_count(statement_.get()), "a column of a row");
  const int type = sqlite3_column_type(statement_.get(), column);
  return type == SQLITE_BLOB || type == SQLITE_TEXT;
}

void Connection::Closer::operator()(sqlite3* database) const {
  sqlite3_close_v2(database);
}

Result<Connection> Connection::open(const std::string& path, Mode mode, const char* vfs) {
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_URI;
  flags |= mode == Mode::Read || mode == Mode::ReadImmutable ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  if (mode == Mode::Create) flags |= SQLITE_OPEN_CREATE;
  std::string uri = path.starts_with("//") ? "file://" : "file:";
  for (const char c : path) {
    constexpr const char* kHex = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    if (c == '?' || c == '#' || c == '%' || byte < 0x20) {
      uri.append({'%', kHex[byte >> 4], kHex[byte & 15]});
    } else {
      uri += c;
    }
  }
  if (mode == Mode::ReadImmutable) uri += "?immutable=1";
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(uri.c_str(), &database, flags, vfs);
  Connection connection(database);
  if (code != SQLITE_OK) return error_of(database, code);
  if (auto done = connection.set_up(mode); !done) return done.error();
  return connection;
}

Result<Connection> Connection::open(std::span<const std::byte> bytes) {
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(":memory:", &database, SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_READWRITE, nullptr);
  Connection connection(database);
  if (code != SQLITE_OK) return error_of(database, code);
  auto* const copy = static_cast<unsigned char*>(sqlite3_malloc64(std::max<std::size_t>(bytes.size(), 1)));
  if (copy == nullptr) throw std::bad_alloc();
  std::memcpy(copy, bytes.data(), bytes.size());
  // A database in memory has no log file: clears the WAL flag in the header.
  constexpr std::size_t kFormatAt = 18;
  if (bytes.size() > kFormatAt + 1 && copy[kFormatAt] == 2) copy[kFormatAt] = copy[kFormatAt + 1] = 1;
  const auto size = static_cast<sqlite3_int64>(bytes.size());
  const int loaded = sqlite3_deserialize(database, "main", copy, size, size,
                                         SQLITE_DESERIALIZE_FREEONCLOSE | SQLITE_DESERIALIZE_READONLY);
  if (loaded != SQLITE_OK) return error_of(database, loaded);
  if (auto done = connection.set_up(Mode::ReadImmutable); !done) return done.error();
  return connection;
}

Status Connection::set_up(Mode mode) {
  if (auto done = harden(database_.get()); !done) return done;
  // Damage is detected on reads. No memory mapping, since a disk fault would end the process.
  if (auto done = run("PRAGMA cell_size_check=ON; PRAGMA mmap_size=0; PRAGMA temp_store=MEMORY"); !done) return done;
  if (mode == Mode::Read || mode == Mode::ReadImmutable) {
    // One connection alone moves the log into the database: see docs/decisions/103.
    sqlite3_db_config(database_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
    return run("PRAGMA query_only=ON; PRAGMA cache_size=-2048");
  }
  sqlite3_wal_autocheckpoint(database_.get(), 0);
  sqlite3_wal_hook(
      database_.get(),
      [](void* pages, sqlite3*, const char*, int count) {
        *static_cast<int*>(pages) = count;
        return SQLITE_OK;
      },
      log_pages_.get());
  return run("PRAGMA cache_size=-2048");
}

Result<Statement> Connection::prepare(std::string_view sql) {
  QUOIN_ASSERT(database_ != nullptr, "an open connection");
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(database_.get(), sql.data(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  Statement prepared(statement);
  if (code != SQLITE_OK) return error_of(database_.get(), code);
  return prepared;
}

Status Connection::run(const char* sql) {
  QUOIN_ASSERT(database_ != nullptr && sql != nullptr, "an open connection, and a statement");
  const int code = sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return error_of(database_.get(), code);
  return {};
}

Result<std::int64_t> Connection::number(const char* sql) {
  auto statement = prepare(sql);
  if (!statement) return statement.error();
  const auto row = statement->step();
  if (!row) return row.error();
  if (!*row) return make_error(ErrorCode::BadFormat, "a query returned no row");
  return statement->integer(0);
}

Result<std::string> Connection::text(const char* sql) {
  auto statement = prepare(sql);
  if (!statement) return statement.error();
  const auto row = statement->step();
  if (!row) return row.error();
  return *row ? std::string(statement->text(0)) : std::string();
}

Status Connection::checkpoint() {
  const int code = sqlite3_wal_checkpoint_v2(database_.get(), nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr);
  if (code != SQLITE_OK && code != SQLITE_BUSY) return error_of(database_.get(), code);
  if (code == SQLITE_OK) *log_pages_ = 0;
  return {};
}

bool Connection::is_in_transaction() const {
  return sqlite3_get_autocommit(database_.get()) == 0;
}

Status Connection::close() {
  sqlite3* const database = database_.release();
  const int code = sqlite3_close(database);
  if (code == SQLITE_OK) return {};
  Error error = error_of(database, code);
  sqlite3_close_v2(database);
  return error;
}

}  // namespace quoin
