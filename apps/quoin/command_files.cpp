#include "command_files.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "run_control.h"

namespace quoin::tool {

Result<OpenedInput> open_input(const std::filesystem::path& path, const LoadOptions& load) {
  OpenedInput input{{path, std::nullopt}, load.raw.has_value()};
  const std::optional<FileFormat>& format = input.file.format;
  if (!load.raw) {
    auto file = detect_file(path);
    if (!file) return file.error();
    input.file = std::move(*file);
    input.is_volume = can(format, FormatCapability::Volume);
  }
  const bool may_have_dimensions = format == FileFormat::Minecraft || format == FileFormat::Scene;
  if (load.dimension.empty() || may_have_dimensions) return input;
  return make_error(ErrorCode::InvalidArgument,
                    "cannot select a dimension: --dimension needs a Minecraft world, and the file format is " +
                        (format ? std::string(format->name()) : "unknown"),
                    path.string());
}

namespace {

constexpr std::size_t kPart = std::size_t{1} << 20;

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

File open(const std::filesystem::path& path, const char* mode) {
  return {std::fopen(path.c_str(), mode), std::fclose};
}

/// Errors: CannotRead, CannotWrite, Cancelled.
Status copy(std::FILE* from, std::FILE* to, const char* from_name, const char* to_name) {
  std::vector<char> part(kPart);
  while (const std::size_t read = std::fread(part.data(), 1, part.size(), from)) {
    if (std::fwrite(part.data(), 1, read, to) != read) {
      return make_error(ErrorCode::CannotWrite, std::strerror(errno), to_name);
    }
    if (was_interrupted()) break;
  }
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", from_name);
  if (std::ferror(from) != 0) return make_error(ErrorCode::CannotRead, std::strerror(errno), from_name);
  if (std::fflush(to) != 0) return make_error(ErrorCode::CannotWrite, std::strerror(errno), to_name);
  return {};
}

}  // namespace

StandardStreams::~StandardStreams() {
  remove();
}

void StandardStreams::remove() {
  std::error_code unknown;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, unknown);
  folder_.clear();
}

Status StandardStreams::make_folder() {
  if (!folder_.empty()) return {};
  std::error_code code;
  std::string name = (std::filesystem::temp_directory_path(code) / "quoin-XXXXXX").string();
  if (code) return make_error(ErrorCode::CannotWrite, code.message(), "the folder for temporary files");
  if (::mkdtemp(name.data()) == nullptr) return make_error(ErrorCode::CannotWrite, std::strerror(errno), name);
  folder_ = name;
  return {};
}

Result<std::filesystem::path> StandardStreams::input() {
  if (Status made = make_folder(); !made) return made.error();
  input_ = folder_ / "input";
  let_interrupts_end_reads();
  const File file = open(input_, "wb");
  if (file == nullptr) return make_error(ErrorCode::CannotWrite, std::strerror(errno), input_.string());
  if (Status copied = copy(stdin, file.get(), "standard input", input_.c_str()); !copied) return copied.error();
  return input_;
}

Status StandardStreams::take_input(std::filesystem::path& name) {
  if (name != kStandardStream) return {};
  catch_interrupts();
  auto file = input();
  if (!file) return file.error();
  name = std::move(*file);
  return {};
}

Result<std::filesystem::path> StandardStreams::output(const std::string& extension) {
  if (Status made = make_folder(); !made) return made.error();
  output_ = folder_ / ("output" + extension);
  return output_;
}

Status StandardStreams::write_output() const {
  const File file = open(output_, "rb");
  if (file == nullptr) return make_error(ErrorCode::CannotRead, std::strerror(errno), output_.string());
  return copy(file.get(), stdout, output_.c_str(), "standard output");
}

std::string StandardStreams::name_of(const std::filesystem::path& path) const {
  return !path.empty() && path == input_ ? "standard input" : path.filename().string();
}

Error StandardStreams::named(Error error) const {
  const auto rename = [](std::string& text, const std::filesystem::path& path, const char* name) {
    if (path.empty()) return;
    for (std::size_t at = text.find(path.string()); at != std::string::npos; at = text.find(path.string())) {
      text.replace(at, path.string().size(), name);
    }
  };
  for (std::string* text : {&error.path, &error.message}) {
    rename(*text, input_, "standard input");
    rename(*text, output_, "standard output");
  }
  return error;
}

Status check_outputs(const std::vector<std::filesystem::path>& files) {
  for (const auto& path : files) {
    if (path.empty()) continue;
    if (auto file = AtomicFile::create(path); !file) return file.error();
  }
  return {};
}

namespace {

std::optional<std::pair<std::uint64_t, std::uint64_t>> identity_of(const std::filesystem::path& name) {
  struct stat found {};
  if (::stat(name.c_str(), &found) != 0) return std::nullopt;
  return std::pair{static_cast<std::uint64_t>(found.st_dev), static_cast<std::uint64_t>(found.st_ino)};
}

}  // namespace

FileSet::FileSet(std::span<const std::filesystem::path> names) {
  for (const auto& name : names) {
    if (const auto file = identity_of(name)) files_.insert(*file);
  }
}

bool FileSet::contains(const std::filesystem::path& name) const {
  const auto file = identity_of(name);
  return file && files_.contains(*file);
}

Status make_folder_of(const std::filesystem::path& file) {
  if (!file.has_parent_path()) return {};
  std::error_code code;
  std::filesystem::create_directories(file.parent_path(), code);
  if (!code) return {};
  return make_error(ErrorCode::CannotWrite, code.message(), file.parent_path().string());
}

Status check_replaced(const std::filesystem::path& output, const FileSet& inputs, bool force) {
  if (inputs.contains(output)) {
    return make_error(ErrorCode::InvalidArgument,
                      "cannot write " + output.string() + ": it is an input file; choose another name");
  }
  std::error_code unknown;
  if (force || !std::filesystem::is_regular_file(output, unknown)) return {};
  const auto format = detect_format(output);
  // A file that cannot be read may be a model.
  if (!format) {
    return make_error(ErrorCode::CannotWrite, "cannot write " + output.string() +
                                                  ": the file exists and cannot be read; use --force to overwrite it");
  }
  // Meshes are results that can be made again, so they are overwritten even if they are readable.
  if (!*format || can(*format, FormatCapability::Meshes)) return {};
  return make_error(ErrorCode::InvalidArgument,
                    "cannot write " + output.string() + ": the file exists; use --force to overwrite it");
}

}  // namespace quoin::tool
