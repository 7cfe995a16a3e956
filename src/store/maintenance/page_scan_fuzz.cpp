#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "store/chunk/chunk_body.h"
#include "store/maintenance/page_scan.h"

namespace {

using namespace quoin::store;

void require(bool holds) {
  if (!holds) std::abort();
}

std::filesystem::path file_name() {
  return std::filesystem::temp_directory_path() / ("quoin_page_scan_fuzz_" + std::to_string(::getpid()));
}

void write(const std::filesystem::path& path, const char* bytes, std::size_t size) {
  std::ofstream(path, std::ios::binary).write(bytes, static_cast<std::streamsize>(size));
}

}  // namespace

// The input is a database, followed by its log; the first byte is the number of the database's 256-byte blocks.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const std::filesystem::path path = file_name();
  static const std::filesystem::path log = path.string() + "-wal";
  static const bool is_tidy = std::atexit([] {
                                std::filesystem::remove(path);
                                std::filesystem::remove(log);
                              }) == 0;
  require(is_tidy);
  const char* const bytes = reinterpret_cast<const char*>(data + 1);
  const std::size_t of_file = std::min<std::size_t>(size - 1, std::size_t{data[0]} * 256);
  write(path, bytes, of_file);
  write(log, bytes + of_file, size - 1 - of_file);
  const auto bodies = scan_bodies(path, [&](std::int64_t, std::span<const std::byte> body) {
    require(body.size() <= size && read_header(body).has_value());
  });
  require(bodies.has_value() || bodies.error().code == quoin::ErrorCode::LimitExceeded);
  const auto records = scan_records(path, [&](const PageRecord& record) {
    require(record.columns.size() >= 2);
    for (const ColumnValue& value : record.columns) {
      const auto* const blob = std::get_if<std::vector<std::byte>>(&value);
      require(blob == nullptr || blob->size() <= size);
    }
  });
  require(records.has_value() || records.error().code == quoin::ErrorCode::LimitExceeded);
  return 0;
}
