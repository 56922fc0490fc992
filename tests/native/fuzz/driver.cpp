// Runs LLVMFuzzerTestOneInput on changed inputs. Those that reach code which none before reached are changed further.
//
//   fuzz_head_file [--seconds N | --runs N] [--seed N] [--max-bytes N] FILES…
//
// Without --seconds and --runs each file is an input, once: to see a crash again. An input that ends the program, or
// takes 20 s, is written to crash-PROGRAM-HASH in the working folder.
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "mutation.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
extern "C" __attribute__((weak)) void __sanitizer_set_death_callback(void (*)());

namespace {

constexpr unsigned kHangSeconds = 20;
constexpr size_t kPlaces = 1 << 16;

// How often each place of the code ran in the present run: places by the hash of their address.
std::array<uint8_t, kPlaces> runs_of_place;  // NOLINT: what the compiler's hook can reach

const fuzz::Bytes* current = nullptr;  // NOLINT: what signal handlers can reach
const char* program = "fuzz";          // NOLINT

uint32_t hash_of(const fuzz::Bytes& bytes) {
  uint32_t hash = 2166136261u;
  for (const uint8_t byte : bytes) hash = (hash ^ byte) * 16777619u;
  return hash;
}

void write_crash() {
  if (!current) return;
  std::array<char, 256> name;
  std::snprintf(name.data(), name.size(), "crash-%s-%08x", program, hash_of(*current));
  const int file = open(name.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file >= 0 && write(file, current->data(), current->size()) == ssize_t(current->size())) {
    std::fprintf(stderr, "The input is in %s.\n", name.data());
  }
  current = nullptr;
}

void on_signal(int number) {
  std::fprintf(stderr, number == SIGALRM ? "An input takes more than %u s.\n" : "Ended by signal %u.\n",
               number == SIGALRM ? kHangSeconds : unsigned(number));
  write_crash();
  _exit(70);
}

void run(const fuzz::Bytes& bytes) {
  runs_of_place.fill(0);
  current = &bytes;
  alarm(kHangSeconds);
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  alarm(0);
  current = nullptr;
}

// Which numbers of runs of each place were seen: once, twice, 3 to 4, 5 to 8, … are a bit each.
class Reached {
 public:
  // Whether the last run has anything new.
  bool add() {
    bool is_new = false;
    for (size_t i = 0; i < kPlaces; ++i) {
      if (runs_of_place[i] == 0) continue;
      uint8_t bit = 1;
      for (int left = runs_of_place[i] - 1; left > 0 && bit < 128; left /= 2) bit = uint8_t(bit << 1);
      if (seen_[i] & bit) continue;
      places_ += seen_[i] == 0;
      seen_[i] = uint8_t(seen_[i] | bit);
      is_new = true;
    }
    return is_new;
  }
  size_t places() const { return places_; }

 private:
  std::array<uint8_t, kPlaces> seen_{};
  size_t places_ = 0;
};

struct Options {
  double seconds = 0;
  size_t runs = 0, max_bytes = 1 << 16;
  uint64_t seed = 1;
  std::vector<fuzz::Bytes> inputs;
};

[[noreturn]] void fail(const std::string& text) {
  std::fprintf(stderr, "%s\n", text.c_str());
  std::exit(2);
}

Options parsed(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string name = arguments[i];
    if (name.rfind("--", 0) == 0) {
      if (i + 1 == count) fail(name + " needs a number.");
      char* end = nullptr;
      const double value = std::strtod(arguments[++i], &end);
      if (*end != 0 || !(value >= 0 && value < 1e15)) fail(name + " needs a number, not " + arguments[i] + ".");
      if (name == "--seconds") {
        options.seconds = value;
      } else if (name == "--runs") {
        options.runs = size_t(value);
      } else if (name == "--seed") {
        options.seed = uint64_t(value);
      } else if (name == "--max-bytes") {
        options.max_bytes = size_t(value);
      } else {
        fail("There is no option " + name + ": --seconds, --runs, --seed, --max-bytes.");
      }
      continue;
    }
    std::ifstream file(name, std::ios::binary);
    if (!file) fail(name + " cannot be read.");
    options.inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return options;
}

}  // namespace

// Called at the start of each block of code that is compiled with -fsanitize-coverage=trace-pc. This file is not.
extern "C" void __sanitizer_cov_trace_pc() {
  const auto at = reinterpret_cast<uintptr_t>(__builtin_return_address(0));
  uint8_t& runs = runs_of_place[(at ^ (at >> 16)) % kPlaces];
  runs = uint8_t(runs + (runs < 255));
}

int main(int count, char** arguments) {
  Options options = parsed(count, arguments);
  program = std::strrchr(arguments[0], '/') ? std::strrchr(arguments[0], '/') + 1 : arguments[0];
  for (const int number : {SIGABRT, SIGALRM}) std::signal(number, on_signal);
  if (__sanitizer_set_death_callback) {
    __sanitizer_set_death_callback(write_crash);
  } else {
    for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(number, on_signal);
  }

  Reached reached;
  std::vector<fuzz::Bytes> kept;
  size_t largest = 0;
  for (const fuzz::Bytes& bytes : options.inputs) {
    run(bytes);
    reached.add();
    kept.push_back(bytes);
    largest = std::max(largest, bytes.size());
  }
  if (options.seconds == 0 && options.runs == 0) {
    std::printf("%zu inputs, once each\n", kept.size());
    return 0;
  }
  if (kept.empty()) kept.emplace_back(16);
  using Clock = std::chrono::steady_clock;
  const auto started = Clock::now();
  const auto spent_s = [&] { return std::chrono::duration<double>(Clock::now() - started).count(); };
  fuzz::Mutator mutator(options.seed, std::max(options.max_bytes, largest));
  size_t runs = 0;
  double told_s = 0;
  const auto tell = [&] {
    std::printf("%.0f s: %zu runs, %zu inputs kept, %zu places reached\n", spent_s(), runs, kept.size(),
                reached.places());
    std::fflush(stdout);
  };
  while (options.runs > 0 ? runs < options.runs : spent_s() < options.seconds) {
    // Half of the time one of the newest, which few changes were made to.
    const size_t newest = std::min<size_t>(kept.size(), 16);
    const size_t chosen = mutator.below(2) == 0 ? mutator.below(kept.size()) : kept.size() - 1 - mutator.below(newest);
    fuzz::Bytes bytes = mutator.changed(kept[chosen], kept[mutator.below(kept.size())]);
    run(bytes);
    ++runs;
    if (reached.add()) kept.push_back(std::move(bytes));
    if (spent_s() > told_s + 10) {
      told_s = spent_s();
      tell();
    }
  }
  tell();
  return 0;
}
