#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <quoin/core/result.h>

struct sqlite3;
struct sqlite3_stmt;

namespace quoin {

/// A prepared statement of a Connection. Parameters and columns count from 0.
class Statement {
 public:
  Statement() = default;

  [[nodiscard]] bool is_prepared() const { return statement_ != nullptr; }
  void bind(int parameter, std::int64_t value);
  void bind(int parameter, std::string_view text);
  /// Lifetime: the bytes until the statement is reset.
  void bind(int parameter, std::span<const std::byte> bytes);

  /// Moves to the next row; returns false after the last. Errors: those of the database; the statement is then reset.
  [[nodiscard]] Result<bool> step();
  /// Runs a statement without rows, and resets it.
  [[nodiscard]] Status run();
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  /// Lifetime: until the next step or reset.
  [[nodiscard]] std::span<const std::byte> bytes(int column) const;
  [[nodiscard]] std::string_view text(int column) const;
  [[nodiscard]] bool is_integer(int column) const;
  /// Returns true for a blob, false for text.
  [[nodiscard]] bool is_bytes(int column) const;

 private:
  friend class Connection;
  struct Finalizer {
    void operator()(sqlite3_stmt* statement) const;
  };
  explicit Statement(sqlite3_stmt* statement) : statement_(statement) {}
  std::unique_ptr<sqlite3_stmt, Finalizer> statement_;
};

/// Resets a statement at the end of its scope, so that no read of the database stays open.
class StatementScope {
 public:
  explicit StatementScope(Statement& statement) : statement_(statement) {}
  StatementScope(const StatementScope&) = delete;
  StatementScope& operator=(const StatementScope&) = delete;
  ~StatementScope() { statement_.reset(); }

 private:
  Statement& statement_;
};

/// An open SQLite database, used by one thread at a time. Errors omit the path; the caller adds it.
class Connection {
 public:
  enum class Mode : std::uint8_t {
    Read,
    /// for a file in a read-only folder: without locks and shared memory
    ReadImmutable,
    Write,
    Create,
  };
  /// `vfs`: the name of a registered SQLite file system; null: the default.
  [[nodiscard]] static Result<Connection> open(const std::string& path, Mode mode, const char* vfs = nullptr);
  /// Opens a database in memory for reading.
  [[nodiscard]] static Result<Connection> open(std::span<const std::byte> bytes);

  [[nodiscard]] Result<Statement> prepare(std::string_view sql);
  /// Runs statements without rows, or ignores their rows.
  [[nodiscard]] Status run(const char* sql);
  /// Return the first column of the first row, as a number or as text. Errors: also if there is no row.
  [[nodiscard]] Result<std::int64_t> number(const char* sql);
  [[nodiscard]] Result<std::string> text(const char* sql);

  /// Writes the write-ahead log's content into the database, except frames that readers still need.
  [[nodiscard]] Status checkpoint();
  /// Returns the number of pages in the write-ahead log after the last commit.
  [[nodiscard]] int log_pages() const { return *log_pages_; }
  [[nodiscard]] bool is_in_transaction() const;
  /// Closes the connection. Errors: those of SQLite for a failed close.
  [[nodiscard]] Status close();
  [[nodiscard]] sqlite3* raw() { return database_.get(); }

 private:
  struct Closer {
    void operator()(sqlite3* database) const;
  };
  explicit Connection(sqlite3* database) : database_(database) {}
  [[nodiscard]] Status set_up(Mode mode);

  std::unique_ptr<sqlite3, Closer> database_;
  std::unique_ptr<int> log_pages_ = std::make_unique<int>(0);
};

/// The message of the error of a damaged database.
inline constexpr const char* kDamagedDatabase = "the database is damaged";

/// Converts SQLite's last error.
[[nodiscard]] Error error_of(sqlite3* database, int code);

}  // namespace quoin
