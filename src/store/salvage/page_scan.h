#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>
#include <quoin/core/function_ref.h>
#include <quoin/core/result.h>
namespace quoin::store {
struct PageRecord {
  std::int64_t row = 0;
  std::vector<std::variant<std::monostate, std::int64_t, std::string, std::vector<std::byte>>> columns;
};
inline Status scan_records(const std::filesystem::path&, FunctionRef<void(const PageRecord&)>) {
  return {};
}
inline Status scan_bodies(const std::filesystem::path&, FunctionRef<void(std::int64_t, std::span<const std::byte>)>) {
  return {};
}
}  // namespace quoin::store
