// tinygltf and tinyobjloader, whose headers hold their code: here they are compiled, for quoin.wasm, as gltf.cpp and
// obj.cpp use them. Files and pictures are read by Quoin.

// tinygltf takes what writes files without asking for it, and libc++ wants paths before streams of files.
#include <filesystem>
#include <fstream>

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
