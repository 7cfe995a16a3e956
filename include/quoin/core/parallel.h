#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <quoin/core/function_ref.h>

namespace [[gnu::visibility("default")]] quoin {

/// The number of threads that a call or an object may keep busy.
///
/// 0: together with the calling thread, as many as the machine has. A call that blocks works on the calling thread too.
///    An object with workers leaves that thread to its caller and has one worker less, at least 1. With a job system
///    (see set_job_system), its workers and the calling thread count instead of the machine's threads.
/// n: a blocking call uses at most n threads, including the calling thread. An object has n workers.
struct Threads {
  unsigned count = 0;
};

/// Returns the number of threads that a blocking call with `threads` uses at most; at least 1. Cost: O(1), no lock.
[[nodiscard]] unsigned thread_count(Threads threads);

/// The order in which a job system starts waiting jobs.
enum class JobPriority : std::uint8_t {
  High,    ///< a caller or an edit waits: meshes of edits, loops of blocking calls
  Normal,  ///< loading, light, tracers, saves, meshes of loaded chunks
  Low,     ///< work that may come late: impostors
};
inline constexpr std::size_t kJobPriorityCount = 3;

/// A piece of work that Quoin gives to a JobSystem: one chunk to load or mesh, one commit of a world, one update of
/// light or of a tracer, or a share of a parallel loop. A job never waits for a job that has not started.
class Job {
 public:
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// Does the work. It may post further jobs, and the same job again. Do not use the object after the call has begun.
  virtual void run() noexcept = 0;

  /// Set while the job waits. The name is a string literal for profilers: "impostor", "light", "loop", "mesh", "store",
  /// "stream" or "tracer".
  JobPriority priority = JobPriority::Normal;
  const char* name = "";
  /// For the job system, from `post` to `run`: a list of waiting jobs needs no memory of its own.
  Job* next = nullptr;

 protected:
  Job() = default;
  ~Job() = default;
};

/// Runs the work of Quoin. Implement it to run this work on the workers of a game:
///
///   class GameJobs final : public quoin::JobSystem {
///     unsigned worker_count() const noexcept override { return game_.worker_count(); }
///     void post(quoin::Job& job) noexcept override { game_.queue(lane(job.priority), [&job] { job.run(); }); }
///     ...
///   };
///   quoin::set_job_system(std::make_shared<GameJobs>());
///
/// Limit:    Quoin then starts no threads, except one in `mesh_world` that returns memory every 10 ms. An object runs
///           at most as many jobs at once as it has workers.
/// Waiting:  a thread that waits for an object (for example LiveMeshes::finish or WorldStore::flush) does that object's
///           work meanwhile, and calls its callbacks. So these functions also return on a job system's only worker.
///           Destructors wait for the object's running jobs, not for its waiting ones, which then do nothing.
/// Errors:   the objects keep exceptions of their jobs, as on threads of their own. After bad_alloc a job pauses for
///           20 ms on its worker.
/// Lifetime: objects keep the job system until their last job has run, so its destructor may run within that job.
/// Threads:  Quoin calls both functions from any thread, including workers, and from several at once.
class JobSystem {
 public:
  JobSystem() = default;
  JobSystem(const JobSystem&) = delete;
  JobSystem& operator=(const JobSystem&) = delete;
  virtual ~JobSystem() = default;

  /// Returns the number of jobs that can run at once; at least 1, always the same.
  [[nodiscard]] virtual unsigned worker_count() const noexcept = 0;
  /// Queues a job, to be run exactly once on any thread, except on this one before `post` has returned: the caller may
  /// hold locks that the job needs. A job that is never run leaks its memory.
  virtual void post(Job& job) noexcept = 0;
};

/// Returns a job system with threads of its own: as many as an object with `workers` has without a job system. They
/// start waiting jobs by priority, and jobs of equal priority in the order of `post`. Lower priorities can starve. The
/// threads are named "quoin worker 1" and so on.
///
///   quoin::set_job_system(quoin::make_worker_pool({.count = 3}));
///
/// Lifetime: its destructor runs the waiting jobs and waits for the running ones. It may be called by one of its jobs.
/// Errors:   std::system_error if a thread cannot start.
[[nodiscard]] std::shared_ptr<JobSystem> make_worker_pool(Threads workers = {});

/// Sets the job system of the process: one limit for all work of Quoin. Null, the default: objects start threads, and
/// parallel loops use those of oneTBB. Set it before other calls, normally once. Objects keep the job system that was
/// set when they were made (an ImpostorCache: when it first built); calls use the current one.
/// Threads:  any, but `Threads{0}` may resolve differently within a call that runs meanwhile.
void set_job_system(std::shared_ptr<JobSystem> jobs);
/// Returns the job system that was set, or null.
[[nodiscard]] std::shared_ptr<JobSystem> job_system();

/// Calls `body(i)` once for every i in [0, count) on several threads, and returns when all calls are done. With a job
/// system, the calling thread does it with the help of jobs that start in time, and waits for no other jobs. These jobs
/// have the priority of the job that calls; otherwise High.
///
/// Order:   unspecified. If call i writes only result i, the output is the same at any thread count.
/// Errors:  an exception from `body` (only bad_alloc is expected) is rethrown to the caller after the other threads
///          stop.
void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body);

}  // namespace quoin
