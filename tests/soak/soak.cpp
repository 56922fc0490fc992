// Uses all systems for a long time in one process, as an app does: soak SECONDS FOLDER. Prints a line of JSON for each
// interval: seconds since the start, memory, open files and threads of the process, and times of each task.
#include <dirent.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double resident_mib() {
  long pages = 0, resident = 0;
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr || std::fscanf(file, "%ld %ld", &pages, &resident) != 2) std::exit(2);
  std::fclose(file);
  return double(resident) * double(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

int entries(const char* folder) {
  DIR* const opened = opendir(folder);
  int count = 0;
  while (readdir(opened) != nullptr) ++count;
  closedir(opened);
  return count - 2;
}

struct Task {
  const char* name;
  int rounds;  // it runs once in so many
  std::function<void()> run;
  std::vector<double> ms = {};
};

double quantile(const std::vector<double>& sorted, double fraction) {
  return sorted[size_t(fraction * double(sorted.size() - 1))];
}

// Endless frames of a stub, whose clock goes on.
class Frames {
 public:
  Frames(const maquette::Context& context, std::string uri) : context_(context), uri_(std::move(uri)) {}
  maquette::Frame next() {
    for (;;) {
      if (!source_) source_.emplace(context_, uri_);
      if (auto frame = source_->next()) return std::move(*frame);
      source_.reset();
    }
  }

 private:
  const maquette::Context& context_;
  std::string uri_;
  std::optional<maquette::Source> source_;
};

void record_and_replay(const maquette::Context& context, const std::string& path) {
  std::remove(path.c_str());
  {
    maquette::Source source(context, "stub:pattern?size=160x120&frames=5");
    maq_recorder_config config;
    maquette::check(maq_recorder_config_init(&config, sizeof config));
    config.jpeg_quality = 80;
    maquette::Recorder recorder(context, path, &source, &config);
    while (const auto frame = source.next()) recorder.add(*frame);
    recorder.finish();
  }
  maquette::Source replayed(context, "rec:" + path);
  while (replayed.next()) continue;
}

void use_pipeline(const maquette::Context& context) {
  maquette::Pipeline pipeline(context);
  pipeline.set_model(maquette::EdgesModel(context));
  pipeline.set_source("stub:solids?size=160x120&fps=30&live=1&frames=6");
  while (pipeline.next()) continue;
}

void make_errors(const maquette::Context& context) {
  for (const char* uri : {"stub:people?size=0x0", "image:/no/such.png", "rec:/dev/null", "nonsense:"}) {
    try {
      maquette::Source source(context, uri);
    } catch (const maquette::Error&) {
    }
  }
}

void soak(double seconds, const std::string& folder) {
  const maquette::Context context;
  maquette::DensePose densepose(context);
  maquette::Edges edges(context);
  maquette::Predictor predictor(context);
  maquette::CameraHealth health(context);
  Frames people(context, "stub:people?count=2&size=320x240"), solids(context, "stub:solids?scene=box&noise=tof");
  Frames moving(context, "stub:people?count=1&size=320x240&fps=30");
  std::vector<Task> tasks = {
      {"dense pose", 1,
       [&] {
         const auto result = densepose.run(people.next());
         (void)result.people();
       }},
      {"edges", 1, [&] { (void)edges.run(solids.next()).find_curves().boxes(); }},
      {"prediction", 1,
       [&] {
         predictor.push(moving.next());
         (void)predictor.predict(0.1);
       }},
      {"camera health", 1, [&] { (void)health.push(people.next()); }},
      {"record and replay", 10, [&] { record_and_replay(context, folder + "/soak.maqrec"); }},
      {"save", 10, [&] { densepose.run(people.next()).save(folder + "/soak"); }},
      {"errors", 10, [&] { make_errors(context); }},
      {"pipeline", 50, [&] { use_pipeline(context); }},
      {"open a model", 100, [&] { maquette::DensePose again(context); }},
  };
  const auto start = Clock::now();
  const double interval_s = std::max(seconds / 120, 1.0);
  double told_s = 0;
  for (long round = 0; seconds_since(start) < seconds; ++round) {
    for (Task& task : tasks) {
      if (round % task.rounds != 0) continue;
      const auto begin = Clock::now();
      task.run();
      task.ms.push_back(1e3 * seconds_since(begin));
    }
    if (seconds_since(start) < told_s + interval_s) continue;
    told_s = seconds_since(start);
    std::printf("{\"seconds\": %.1f, \"resident_mib\": %.2f, \"files\": %d, \"threads\": %d, \"tasks\": {", told_s,
                resident_mib(), entries("/proc/self/fd"), entries("/proc/self/task"));
    const char* comma = "";
    for (Task& task : tasks) {
      if (task.ms.empty()) continue;
      std::sort(task.ms.begin(), task.ms.end());
      std::printf("%s\"%s\": [%zu, %.3f, %.3f]", comma, task.name, task.ms.size(), quantile(task.ms, 0.5),
                  quantile(task.ms, 0.99));
      task.ms.clear();
      comma = ", ";
    }
    std::printf("}}\n");
    std::fflush(stdout);
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  try {
    soak(std::atof(arguments[1]), arguments[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
