// packs/stack/*: a generated pack of 120 MB with 4,000 textures of 256 x 256 texels and 3,000 models, as a zip file.
//
//   open            opens the file
//   looks/N         opens it and gives N types their looks; the texels stay compressed
//   texels/N        decodes the textures of N types, as an image does that shows all of them
// packs/builtin/400 gives 412 blocks of the game, in all colours and woods, the looks of Quoin's own pack: packs delay
//                   the first image of such a world by this time
// packs/jar/read    a .jar of 30 MB with 8,000 class files: opens it and reads 300 files of its pack
//
// All threads of the machine. Counters: peak_mb, the largest memory of the process during the work; kept_mb, after the
// packs were closed, above the memory before.

#include <quoin/io/block_packs.h>

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/io/file.h>

#include "bench/process_memory.h"
#include "io/packs/pack_files.h"
#include "io/packs/packs_for_tests.h"

namespace quoin {
namespace {

void require(bool holds, const char* text) {
  if (holds) return;
  std::fprintf(stderr, "packs benchmark: %s\n", text);
  std::exit(1);
}

// A file that is generated once and removed at the end.
class GeneratedFile {
 public:
  GeneratedFile(const char* name, std::vector<std::byte> (*make)())
      : path_(std::filesystem::temp_directory_path() / (std::to_string(::getpid()) + name)) {
    require(write_file(make(), path_).has_value(), "cannot write a temporary file");
  }
  GeneratedFile(const GeneratedFile&) = delete;
  GeneratedFile& operator=(const GeneratedFile&) = delete;
  ~GeneratedFile() {
    std::error_code error;
    std::filesystem::remove(path_, error);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

const std::filesystem::path& stack() {
  static const GeneratedFile file("stack.zip", [] { return packs_test::pack_stack({}); });
  return file.path();
}

const std::filesystem::path& jar() {
  static const GeneratedFile file("client.jar", [] {
    ZipFile zip;
    for (std::uint32_t i = 0; i < 8'000; ++i) {
      // Half of the bytes are noise, as in compiled code.
      std::string code(6'400, '\0');
      for (std::uint32_t k = 0; k < code.size() / 2; ++k) code[k] = static_cast<char>(mix_bits(mix_bits(k) ^ i));
      zip.begin("net/game/" + std::to_string(i % 97) + "/C" + std::to_string(i) + ".class");
      zip.put(code);
    }
    for (int i = 0; i < 300; ++i) {
      zip.begin("assets/minecraft/models/block/m" + std::to_string(i) + ".json");
      zip.put(R"({"parent": "block/cube_all", "textures": {"all": "block/stone"}})");
    }
    return std::move(*zip.take());
  });
  return file.path();
}

std::shared_ptr<BlockPacks> opened() {
  const std::vector<std::filesystem::path> paths = {stack()};
  auto packs = BlockPacks::open(paths);
  require(packs.has_value(), "cannot open the pack");
  return std::move(*packs);
}

void open_stack(benchmark::State& state) {
  state.counters["file_mb"] = static_cast<double>(std::filesystem::file_size(stack())) / 1e6;
  const auto bytes = std::filesystem::file_size(stack());
  require(bytes > 100'000'000 && bytes < 140'000'000, "the pack has not about 120 MB");
  ::malloc_trim(0);
  reset_peak();
  for (auto _ : state) benchmark::DoNotOptimize(opened());
  state.counters["peak_mb"] = status_megabytes("VmHWM:");
}

// Counts the textures of types, and those with texels.
std::pair<std::size_t, std::size_t> textures_of(const VoxelRegistry& types) {
  TextureSet all;
  all.add(types);
  std::pair<std::size_t, std::size_t> count;
  for (const TextureSet::Array& array : all.arrays()) {
    count.first += array.layers.size();
    for (const Texture& texture : array.layers) count.second += texture.has_texels() ? 1 : 0;
  }
  return count;
}

void give_looks(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const VoxelRegistry plain = packs_test::stack_types(count);
  static_cast<void>(stack());
  ::malloc_trim(0);
  reset_peak();
  const double before = status_megabytes("VmRSS:");
  std::optional<VoxelRegistry> types;
  for (auto _ : state) {
    types.emplace(plain);
    const std::shared_ptr<BlockPacks> packs = opened();
    packs->apply(*types);
    require(packs->report().names.empty(), "a look is missing");
  }
  state.counters["peak_mb"] = status_megabytes("VmHWM:");
  ::malloc_trim(0);
  state.counters["kept_mb"] = status_megabytes("VmRSS:") - before;
  const auto [textures, decoded] = textures_of(*types);
  require(textures >= static_cast<std::size_t>(count) && decoded == 0, "wrong textures");
  require(types->has_shapes() && types->has_textures(), "no shapes or textures");
  state.counters["textures"] = static_cast<double>(textures);
}

void decode(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const VoxelRegistry plain = packs_test::stack_types(count);
  double peak = 0.0;
  for (auto _ : state) {
    state.PauseTiming();
    {
      VoxelRegistry types = plain;
      opened()->apply(types);
      ::malloc_trim(0);
      reset_peak();
      state.ResumeTiming();
      decode_textures(types, {});
      state.PauseTiming();
      peak = std::max(peak, status_megabytes("VmHWM:"));
      const auto [textures, decoded] = textures_of(types);
      require(textures == decoded, "a texture has no texels");
    }
    state.ResumeTiming();
  }
  state.counters["peak_mb"] = peak;
}

// Returns the types of 16 colours of 12 blocks and 11 woods of 20.
VoxelRegistry game_types() {
  minecraft::BlockTypes types;
  const auto add = [&](std::string_view materials, std::string_view blocks) {
    for (const auto material : std::views::split(materials, ' ')) {
      for (const auto block : std::views::split(blocks, ' ')) {
        const std::string name = std::string(material.begin(), material.end()) + "_";
        require(types.block("minecraft:" + name + std::string(block.begin(), block.end()), {}).has_value(), "no type");
      }
    }
  };
  add("white orange magenta light_blue yellow lime pink gray light_gray cyan purple blue brown green red black",
      "wool carpet concrete concrete_powder terracotta glazed_terracotta stained_glass stained_glass_pane bed banner "
      "candle shulker_box");
  add("oak spruce birch jungle acacia dark_oak mangrove cherry bamboo crimson warped",
      "planks log stripped_log wood stripped_wood stairs slab fence fence_gate door trapdoor pressure_plate button "
      "sign "
      "hanging_sign wall_sign sapling roots propagule mosaic");
  return types.types();
}

void give_own_looks(benchmark::State& state) {
  const VoxelRegistry plain = game_types();
  require(plain.size() > 400, "fewer than 400 types");
  const std::vector<std::filesystem::path> own = {kBuiltinPack};
  for (auto _ : state) {
    VoxelRegistry types = plain;
    const auto packs = BlockPacks::open(own);
    require(packs.has_value(), "cannot open the own pack");
    (*packs)->apply(types);
    require((*packs)->report().without_look == 0, "a block without a look");
    decode_textures(types, {});
  }
  state.counters["types"] = static_cast<double>(plain.size() - 1);
}

void read_jar(benchmark::State& state) {
  require(std::filesystem::file_size(jar()) > 25'000'000, "the .jar is smaller than 25 MB");
  ::malloc_trim(0);
  for (auto _ : state) {
    const auto pack = packs::open_pack(jar());
    require(pack.has_value(), "cannot open the .jar");
    for (int i = 0; i < 300; ++i) {
      const auto bytes = (*pack)->read("assets/minecraft/models/block/m" + std::to_string(i) + ".json", 1'000);
      require(bytes && *bytes && (*bytes)->size() > 50, "a file is missing");
    }
  }
}

BENCHMARK(open_stack)->Name("packs/stack/open")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(give_looks)
    ->Name("packs/stack/looks")
    ->Arg(300)
    ->Arg(3'000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(decode)
    ->Name("packs/stack/texels")
    ->Arg(300)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(give_own_looks)
    ->Name("packs/builtin/400")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK(read_jar)->Name("packs/jar/read")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace quoin
