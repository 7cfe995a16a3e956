// Compiles the header-only libraries tinygltf and tinyobjloader for quoin.wasm, with the settings of gltf.cpp and
// obj.cpp. Quoin itself reads files and images.

// tinygltf uses file streams without including them, and libc++ needs <filesystem> first.
#include <filesystem>
#include <fstream>

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
