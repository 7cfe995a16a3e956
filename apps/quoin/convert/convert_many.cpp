#include <algorithm>
#include <iterator>
#include <map>
#include <mutex>
#include <new>
#include <set>

#include <quoin/core/parallel.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "convert/convert.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

namespace fs = std::filesystem;

/// One of several files, and the result of its conversion.
struct Task {
  fs::path input;
  fs::path output;
  std::optional<Outcome> outcome;
  std::optional<Error> error;
  Stamps stamps{};  ///< of the input and its sidecar files, taken before reading
};

Error error_of(const fs::path& path, const std::error_code& code) {
  return make_error(ErrorCode::CannotRead, code.message(), path.string());
}

/// Returns true if the extension is that of a readable format. A .json file does not count: it can be anything.
bool is_named_to_be_read(const fs::path& file) {
  const auto format = format_with_extension(file, FormatCapability::Read);
  return format && format->format != FileFormat::Scene;
}

/// Returns the files in a folder and its subfolders that are readable or have a readable extension, sorted by name.
/// Skips files below `without`, and meshes next to a model of the same name, which were made from it. Adds unreadable
/// folders to `errors`.
Result<std::vector<fs::path>> files_below(const fs::path& folder, const std::optional<fs::path>& without,
                                          std::vector<Error>& errors) {
  std::vector<fs::path> found;
  std::vector<fs::path> meshes;
  std::set<fs::path> models;  // without their extensions
  std::error_code code;
  fs::recursive_directory_iterator at(folder, code);
  for (; !code && at != fs::recursive_directory_iterator(); at.increment(code)) {
    std::error_code is_broken;
    if (at->is_directory(is_broken)) {
      const fs::directory_iterator opened(at->path(), is_broken);
      if (is_broken) errors.push_back(error_of(at->path(), is_broken));
      // Do not convert the results of earlier runs.
      if (is_broken || (without && is_same_file(*without, at->path()))) at.disable_recursion_pending();
      continue;
    }
    if (!at->is_regular_file(is_broken)) continue;
    const auto format = detect_format(at->path());
    // Keep files that cannot be opened, to report them. Skip files in unknown formats.
    if (format && !*format && !is_named_to_be_read(at->path())) continue;
    const bool is_mesh = format && can(*format, FormatCapability::Meshes);
    (is_mesh ? meshes : found).push_back(at->path());
    if (!is_mesh) models.insert(at->path().parent_path() / stem_of_file(at->path()));
  }
  if (code) return error_of(folder, code);
  std::ranges::copy_if(meshes, std::back_inserter(found),
                       [&](const fs::path& mesh) { return !models.contains(mesh.parent_path() / stem_of_file(mesh)); });
  std::sort(found.begin(), found.end());
  return found;
}

/// Returns one task per input file. Adds inputs that cannot be listed to `errors`.
std::vector<Task> plan(const ManyOptions& many, const std::string& extension, std::vector<Error>& errors) {
  std::vector<Task> tasks;
  const auto add = [&](const fs::path& input, const fs::path& input_folder, const fs::path& below) {
    const fs::path folder = !many.folder ? input_folder : below == "." ? *many.folder : *many.folder / below;
    tasks.push_back({input, folder / (stem_of_file(input) + extension), {}, {}});
  };
  for (const fs::path& input : many.inputs) {
    std::error_code unknown;
    if (!fs::is_directory(input, unknown)) {
      add(input, input.parent_path(), {});
      continue;
    }
    if (!many.recursive) {
      errors.push_back(
          make_error(ErrorCode::CannotRead, "is a folder; use --recursive to convert the files in it", input.string()));
      continue;
    }
    const auto files = files_below(input, many.folder, errors);
    if (!files) {
      errors.push_back(files.error());
      continue;
    }
    if (files->empty())
      errors.push_back(make_error(ErrorCode::CannotRead, "the folder has no readable files", input.string()));
    for (const fs::path& file : *files) {
      const bool is_product = !many.folder && file.extension() == extension;
      if (!is_product) add(file, file.parent_path(), file.parent_path().lexically_relative(input));
    }
  }
  return tasks;
}

/// Returns a path that is the same for all names of the same folder.
fs::path real_name(const fs::path& file) {
  std::error_code unknown;
  const fs::path folder = fs::weakly_canonical(fs::absolute(file, unknown).parent_path(), unknown);
  return unknown ? file.lexically_normal() : folder / file.filename();
}

/// Merges tasks with the same input. Errors: InvalidArgument if two inputs have the same output.
Status merge_same_inputs(std::vector<Task>& tasks) {
  std::map<fs::path, fs::path> made;
  std::vector<Task> kept;
  for (Task& task : tasks) {
    const auto [at, is_new] = made.emplace(real_name(task.output), task.input);
    if (is_new) {
      kept.push_back(std::move(task));
    } else if (at->second != task.input && !is_same_file(at->second, task.input)) {
      return make_error(ErrorCode::InvalidArgument, at->second.string() + " and " + task.input.string() +
                                                        " would both be written to " + task.output.string());
    }
  }
  tasks = std::move(kept);
  return {};
}

void run_task(const ConvertOptions& wanted, const FormatInfo& format, Task& task) {
  ConvertOptions options = wanted;
  options.common.input = task.input;
  options.output = task.output;
  try {
    Conversion outcome = convert_file(options, format);
    if (outcome) {
      task.outcome = std::move(*outcome);
    } else {
      task.error = outcome.error();
    }
  } catch (const std::bad_alloc&) {
    task.error = make_error(ErrorCode::LimitExceeded, "out of memory", task.input.string());
  }
  if (task.error && task.error->path.empty()) task.error->path = task.input.string();
}

/// Removes tasks whose inputs have not changed since their conversion.
void leave_out(const Converted& done, SidecarFiles allowed, std::vector<Task>& tasks, WatchedWork& work) {
  for (Task& task : tasks) {
    work.written.push_back(task.output);
    const std::vector<fs::path> read = files_read(task.input, allowed);
    work.read.insert(work.read.end(), read.begin(), read.end());
    task.stamps = stamps_of(read);
  }
  std::erase_if(tasks, [&](const Task& task) {
    const auto found = done.find(task.input);
    return found != done.end() && found->second == task.stamps;
  });
}

/// Records the stamps of all tasks. Failed tasks also run again only after a change.
void note(const std::vector<Task>& tasks, Converted& done, WatchedWork& work) {
  for (const Task& task : tasks) {
    done[task.input] = task.stamps;
    if (!task.outcome) continue;
    work.written.insert(work.written.end(), task.outcome->files.begin(), task.outcome->files.end());
  }
}

/// Runs the tasks in parallel. If there are fewer files than threads, each file gets an equal share of the threads.
void run_tasks(ConvertOptions options, const FormatInfo& format, std::vector<Task>& tasks) {
  const unsigned threads = thread_count(options.common.threads);
  const auto files = static_cast<unsigned>(std::max<std::size_t>(tasks.size(), 1));
  options.is_one_of_many = true;
  options.common.threads = {std::max(threads / files, 1U)};
  ProgressBar bar;
  const Progress progress = bar.listener("files");
  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(tasks.size(), {threads}, [&](std::size_t i) {
    if (was_interrupted()) return;
    run_task(options, format, tasks[i]);
    const std::lock_guard lock(mutex);
    (void)progress(static_cast<double>(++done) / static_cast<double>(tasks.size()));
  });
}

struct Totals {
  std::size_t converted = 0;
  std::uint64_t bytes = 0;
  double seconds = 0;
};

/// `errors`: inputs that could not be listed; the tasks hold their own errors.
Json json_of(const std::vector<Task>& tasks, const std::vector<Error>& errors, const Totals& totals) {
  Json converted = Json::array();
  Json failed = Json::array();
  for (const Error& error : errors) failed.push_back({{"input", error.path}, {"error", to_string(error)}});
  for (const Task& task : tasks) {
    if (task.error) {
      failed.push_back({{"input", task.input.string()}, {"error", to_string(*task.error)}});
      continue;
    }
    Json entry = {{"input", task.input.string()}};
    entry.update(outcome_json(*task.outcome));
    converted.push_back(std::move(entry));
  }
  return {{"converted", converted}, {"failed", failed}, {"bytes", totals.bytes}, {"seconds", totals.seconds}};
}

/// Prints the errors last. Returns the exit status, as `print` does.
int print_text(const std::vector<Task>& tasks, const std::vector<Error>& errors, const Totals& totals) {
  std::string text;
  for (const Task& task : tasks) {
    if (!task.outcome) continue;
    for (const std::string& warning : task.outcome->warnings) {
      print_error("warning: " + task.input.string() + ": " + warning);
    }
    text += on_one_line(task.input.string() + " -> " + task.output.string()) + ", " +
            bytes_for_people(task.outcome->bytes) + "\n";
  }
  const auto count = [](std::size_t n) { return with_thousands(static_cast<std::int64_t>(n)); };
  text += "Converted " + count(totals.converted) + " of " + count(tasks.size() + errors.size()) + ", " +
          bytes_for_people(totals.bytes) + " in " + number_for_people(totals.seconds) + " s\n";
  const int printed = print_summary(text);
  for (const Error& error : errors) print_error(error);
  for (const Task& task : tasks) {
    if (task.error) print_error(*task.error);
  }
  return printed;
}

FileSet inputs_of(const std::vector<Task>& tasks) {
  std::vector<fs::path> inputs;
  inputs.reserve(tasks.size());
  for (const Task& task : tasks) inputs.push_back(task.input);
  return FileSet(inputs);
}

Totals totals_of(const std::vector<Task>& tasks, double seconds) {
  Totals totals;
  for (const Task& task : tasks) {
    if (!task.outcome) continue;
    ++totals.converted;
    totals.bytes += task.outcome->bytes;
  }
  totals.seconds = seconds;
  return totals;
}

}  // namespace

WatchedWork run_many(const ConvertArguments& arguments, Converted& done) {
  const ConvertOptions& options = arguments.options;
  const ManyOptions& many = arguments.many;
  WatchedWork work;
  work.read = many.inputs;
  const auto ended = [&](int status) {
    work.status = status;
    return work;
  };
  catch_interrupts();
  Stopwatch watch;
  std::vector<Error> errors;
  std::vector<Task> tasks = plan(many, (many.to.starts_with('.') ? "" : ".") + many.to, errors);
  if (const Status merged = merge_same_inputs(tasks); !merged) {
    print_error(merged.error());
    return ended(kWrongUsage);
  }
  ConvertOptions wanted = options;
  wanted.inputs = inputs_of(tasks);
  const bool is_again = !done.empty();
  if (options.watch) leave_out(done, options.common.load.sidecar_files, tasks, work);
  run_tasks(wanted, *arguments.format, tasks);
  die_if_interrupted();
  if (options.watch) note(tasks, done, work);
  if (is_again && tasks.empty() && errors.empty()) return ended(kDone);
  const Totals totals = totals_of(tasks, watch.lap());
  const bool is_whole = totals.converted == tasks.size() && errors.empty();
  const int printed =
      options.common.json ? print_json(json_of(tasks, errors, totals)) : print_text(tasks, errors, totals);
  return ended(printed == kDone && !is_whole ? kFailed : printed);
}

}  // namespace quoin::tool
