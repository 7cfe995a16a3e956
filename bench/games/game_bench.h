// Instruments of the three games: clocks, allocations per frame, a ledger of the surfaces that a player sees, and the
// lines of the table. They read the results of the library through its public headers.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <quoin/quoin.h>

namespace games {

struct Options {
  double radius = 1024.0;  // of the viewer, in voxels
  int edits = 10'000;      // in the digging phase
  bool is_short = false;   // few frames, more checks of the result, no times
  bool with_parts = false;
  bool with_arena = false;             // the game supplies the large blocks of Quoin: see quoin::set_block_functions
  std::filesystem::path folder = ".";  // for worlds
  // Frames of a phase that has `frames` in the full run.
  [[nodiscard]] int frames(int full) const { return is_short ? full / 10 : full; }
};

// Parses the options of a game. Exits with 2 if they are wrong.
Options parse(int argc, char** argv);

// Frames without pending work after which an edit that is not shown is a fault.
inline constexpr int kMaxIdleFrames = 500;

// Milliseconds.
double wall_ms();
double thread_ms();
double process_ms();
// Number of allocations of this thread by operator new.
std::int64_t allocations();

// Waits for the next frame of 1/60 second, or 1/500 second in the short version.
class Pace {
 public:
  explicit Pace(const Options& options);
  void wait();

 private:
  std::chrono::microseconds frame_;
  std::chrono::steady_clock::time_point next_;
};

enum class Statistic : std::uint8_t { Median, P99, P999, Max };

struct Goal {
  Statistic of = Statistic::Max;
  double limit = 0.0;
};

// Writes the rows of the table as lines of tab-separated fields, and collects failed checks.
class Report {
 public:
  Report(std::string game, const Options& options) : game_(std::move(game)), options_(options) {}
  // Rows that depend on the machine. The short version leaves them out.
  void samples(const std::string& row, const std::string& unit, std::vector<double> all, std::vector<Goal> goals = {});
  void value(const std::string& row, const std::string& unit, double value, std::optional<double> limit = std::nullopt);
  // A number of faults: anything except 0 is an error of the library or the game, in every version.
  void faults(const std::string& row, std::int64_t found, std::int64_t of, const std::string& things);
  // A condition of the result.
  void expect(bool condition, const std::string& text);
  // Writes the failed checks to standard error. Returns the exit status: 1 if there are any.
  [[nodiscard]] int finish() const;

 private:
  void line(const std::string& row, const std::string& unit, const std::array<double, 4>& values, bool is_single,
            const std::vector<Goal>& goals);

  std::string game_;
  Options options_;
  std::vector<std::string> failed_;
};

// Processor time and allocations of the game's thread, per frame and per part of it.
class FrameMeter {
 public:
  void begin();
  // Ends a part of the frame.
  void part(const char* name);
  // Leaves out everything since the last part: work of the instruments.
  void skip();
  // Allocations from here to the end of the frame do not count: those of Shown.
  void stop_counting();
  void end();
  void report(Report& report, const Options& options, const std::string& phase, std::vector<Goal> goals,
              std::optional<double> most_allocations) const;

 private:
  struct Part {
    std::vector<double> ms, allocations;
  };
  std::map<std::string, Part, std::less<>> parts_;
  std::vector<double> frames_, allocations_;
  double start_ = 0.0, part_start_ = 0.0, own_ = 0.0;
  std::int64_t allocations_at_start_ = 0, own_allocations_ = 0, part_allocations_ = 0;
  std::optional<std::int64_t> allocations_at_stop_;
};

// The light of a face that a player sees, at the corners with the most light: twelfths of a level.
struct ShownFace {
  std::uint32_t brightest = 0;
  quoin::VoxelType type = quoin::kAir;
};

// Surfaces that were taken and not replaced: the surfaces on the screen.
class Shown {
 public:
  void apply(const std::vector<quoin::SurfaceUpdate>& updates);
  [[nodiscard]] const quoin::ChunkSurface* find(quoin::GridHandle grid, quoin::IVec3 chunk,
                                                quoin::SurfaceContent content) const;
  // A voxel's face, if it is shown.
  [[nodiscard]] std::optional<ShownFace> face(quoin::GridHandle grid, quoin::IVec3 voxel, quoin::Direction side) const;
  // The shown faces among the twelve between a voxel and its neighbours. Bit 2 * side: the voxel's own face. Bit
  // 2 * side + 1: the neighbour's face towards the voxel.
  [[nodiscard]] unsigned faces_around(quoin::GridHandle grid, quoin::IVec3 voxel) const;
  // Number of edges of triangles without a neighbour, in a box of chunks of a field. Its surface should be closed,
  // except where it leaves the box: edges within a voxel of the box's sides do not count.
  [[nodiscard]] int open_edges(quoin::GridHandle grid, const quoin::IBox& chunks) const;
  // Number of chunks whose surfaces differ from those that new meshes (and new light) of the scene have.
  [[nodiscard]] int differences(const quoin::Scene& scene, bool with_light, quoin::DVec3 eye) const;
  [[nodiscard]] std::size_t chunks() const { return surfaces_.size(); }
  // Bytes of the surfaces, and of the vertices that `convert` made of them.
  [[nodiscard]] std::pair<std::size_t, std::size_t> bytes() const;

 private:
  struct Key {
    quoin::GridHandle grid;
    quoin::IVec3 chunk{0};
    quoin::SurfaceContent content{};
    bool operator<(const Key& other) const;
  };
  // A position in a field, exact: those of vertices are multiples of 2^-16.
  struct Corner {
    static constexpr std::int64_t kUnit = 65'536;
    std::array<std::int64_t, 3> at{};
    bool operator==(const Corner&) const = default;
    auto operator<=>(const Corner&) const = default;
  };
  using Edge = std::pair<Corner, Corner>;
  struct Entry {
    std::shared_ptr<const quoin::ChunkSurface> surface;
    mutable std::shared_ptr<const std::vector<Edge>> open;  // edges without a neighbour, once they were needed
  };
  struct EdgeHash;
  struct OddEdges;
  static std::vector<Edge> open_edges_of(const Entry& entry, quoin::IVec3 chunk);

  std::map<Key, Entry> surfaces_;
};

// The faces around a voxel that a correct screen shows, from the voxels: as Shown::faces_around.
unsigned expected_faces(const quoin::Grid& grid, const quoin::VoxelRegistry& types, quoin::IVec3 voxel);

// Compares the screen with the scene after edits, frame by frame. Edits of one frame must appear in one frame, on both
// sides of chunk borders, with their light.
class EditWatch {
 public:
  struct Voxel {
    quoin::GridHandle grid;
    quoin::IVec3 voxel{0};
    unsigned before = 0, after = 0;  // as Shown::faces_around
    bool in_daylight = false;
  };
  // Adds the edits of one frame. Edits must be at least three voxels from all others that wait.
  void add(std::vector<Voxel> voxels);
  void check(const Shown& shown);
  // True if an edit that is not shown yet is near.
  [[nodiscard]] bool waits_near(quoin::IVec3 voxel) const;
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  // Reports a phase, and begins the next one.
  void report(Report& report, const std::string& phase, std::vector<Goal> latency_goals);

 private:
  struct Edits {
    std::vector<Voxel> voxels;
    double start_ms = 0.0, process_start_ms = 0.0;
    bool was_torn = false, was_doubled = false;
  };
  // True if all of the edits are shown. Notes in them if only some are.
  static bool are_complete(const Shown& shown, Edits& edits);
  static bool is_black(const Shown& shown, const Edits& edits);

  std::vector<Edits> waiting_;
  std::vector<double> latencies_ms_, process_latencies_ms_;
  std::int64_t edits_ = 0;
  std::int64_t frames_ = 0, torn_ = 0, doubled_ = 0, black_ = 0;  // frames with edits
};

// Copies vertices into one buffer, as a game copies them into memory that the GPU reads.
class Staging {
 public:
  explicit Staging(std::size_t bytes) : memory_(bytes) {}
  void copy(std::span<const std::byte> bytes);
  // True if these bytes were copied last.
  [[nodiscard]] bool ends_with(std::span<const std::byte> bytes) const;
  [[nodiscard]] std::size_t total() const { return total_; }

 private:
  std::vector<std::byte> memory_;
  std::size_t at_ = 0, total_ = 0;
};

// Hashes of the loaded chunks of a grid, voxels and field, to compare a world with itself after it is opened again.
std::map<quoin::IVec3, std::uint64_t, quoin::ByZyx> hashes_of(const quoin::SceneGrid& grid);

// Reports the memory of the process and of its parts, in bytes.
void report_memory(Report& report, const std::vector<std::pair<std::string, std::size_t>>& parts);

// Reports loading: wall time, and processor time of all threads.
void report_loading(Report& report, double wall_start_ms, double process_start_ms, std::optional<double> most_seconds);

// Writes the error and ends the program: with 77, skipped, if this build lacks worlds on disk, else with 2.
[[noreturn]] void fail(const quoin::Error& error);

// Ends the program if a call of the library failed.
template <class R>
void require(const R& result) {
  if (!result) fail(result.error());
}

// Opens a world, or makes it. Ends the program if that fails.
quoin::StreamedWorld open_world(const std::filesystem::path& path);

// Ends a frame: takes the new tracer and at most `max_bytes` of loaded surfaces, uploads them, and shows them. Returns
// them.
template <class Upload>
std::vector<quoin::SurfaceUpdate> end_frame(FrameMeter& meter, quoin::LiveTracer& tracer, quoin::LiveMeshes& meshes,
                                            std::size_t max_bytes, Shown& shown, Upload&& upload) {
  tracer.take();
  std::vector<quoin::SurfaceUpdate> updates = meshes.take(max_bytes);
  meter.part("take");
  for (const quoin::SurfaceUpdate& update : updates) upload(update);
  meter.part("upload");
  meter.stop_counting();
  shown.apply(updates);
  meter.part("replace surfaces");
  meter.end();
  return updates;
}

// Runs frames until no work is pending, and further ones while edits wait to be shown. After kMaxIdleFrames of those,
// the waiting edits are faults.
template <class Frame, class IsBusy, class IsWaiting>
void settle(Frame&& frame, IsBusy&& is_busy, IsWaiting&& is_waiting) {
  FrameMeter unused;
  int idle_frames = 0;
  do {
    frame(unused);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    idle_frames = is_busy() ? 0 : idle_frames + 1;
  } while (idle_frames == 0 || (is_waiting() && idle_frames < kMaxIdleFrames));
}

}  // namespace games
