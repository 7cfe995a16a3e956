#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

#include "quoin.h"

/// The C++ counterpart of QUOIN_INIT.
template <class T>
T sized() {
  T made{};
  made.size = sizeof made;
  return made;
}

/// Returns the path of a file in a temporary folder, which is removed with the process.
inline std::string test_file(const std::string& name) {
  struct Folder {
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("quoin_c_test_" + std::to_string(::getpid()));
  };
  static const Folder folder;
  return (folder.path / name).string();
}
