#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

#include "quoin.h"

/// What QUOIN_INIT is in C.
template <class T>
T sized() {
  T made{};
  made.size = sizeof made;
  return made;
}

/// The path of a file of that name in a folder that ends with the process.
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
